//! The configuration that the tests start from.

use simulator::{SceneConfig, SceneKind};

/// The defaults of `config/server.toml` in a small picture and a short run.
pub fn small(scene: SceneKind) -> SceneConfig {
    let all: toml::Table =
        include_str!("../../../../config/server.toml").parse().expect("the configuration is TOML");
    let defaults: SceneConfig = all["simulate"].clone().try_into().expect("[simulate] has every key");
    SceneConfig { scene, width_px: 160, height_px: 120, frames: 40, points: 300, ..defaults }
}
