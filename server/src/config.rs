//! Every option of the server, section by section.

use std::path::Path;

use serde::{Deserialize, Serialize};
pub use settings::SettingsError;

/// Every option of the server; one field for each section of `config/server.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Limits that a calibration must keep to.
    pub rig: geometry::RigLimits,
    /// Which pictures are fused.
    pub quality: crate::session::quality::QualityConfig,
    /// The GPU.
    pub gpu: gpu::AdapterSelection,
    /// Stereo matching.
    pub disparity: dense::disparity::DisparityConfig,
    /// The surfel model.
    pub dense: dense::DenseConfig,
    /// The tracker.
    pub tracking: tracking::TrackingConfig,
    /// Topics of recordings.
    pub recording: recording::RecordingConfig,
    /// Defaults of simulated scenes.
    pub simulate: simulator::SceneConfig,
    /// The HTTP server.
    pub server: crate::http::ServerConfig,
    /// Session life times and limits.
    pub session: crate::session::SessionConfig,
    /// The zenoh peer.
    pub zenoh: crate::ingest::ZenohConfig,
    /// How carts deal with a server that is away.
    pub cart: mis_slam_cart::ConnectionConfig,
    /// What is kept on the disk.
    pub storage: crate::storage::StorageConfig,
    /// Who may do what.
    pub access: crate::http::access::AccessConfig,
    /// What viewers get.
    pub publish: crate::publish::PublishConfig,
}

/// Options that are built in beside the defaults: the files of that name in `config/profiles`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// The defaults.
    Default,
    /// Less work per frame, for live scopes on modest GPUs.
    Realtime,
    /// For machines without a GPU.
    Cpu,
}

impl Profile {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Default, Self::Realtime, Self::Cpu];

    fn text(self) -> &'static str {
        match self {
            Self::Default => "",
            Self::Realtime => include_str!("../../config/profiles/realtime.toml"),
            Self::Cpu => include_str!("../../config/profiles/cpu.toml"),
        }
    }
}

impl std::fmt::Display for Profile {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Default => "default",
            Self::Realtime => "realtime",
            Self::Cpu => "cpu",
        })
    }
}

impl Config {
    /// As [`Config::load`], over a profile in place of the bare defaults.
    ///
    /// # Errors
    /// [`SettingsError`] names the key or file.
    pub fn load_over(
        profile: Profile,
        file: Option<&Path>,
        overrides: &[String],
    ) -> Result<Self, SettingsError> {
        settings::load_over(profile.text(), file, overrides)
    }

    /// The defaults, with `file` and then `overrides` (`section.key=value`) laid over them.
    ///
    /// # Errors
    /// [`SettingsError`] names the key or file.
    pub fn load(file: Option<&Path>, overrides: &[String]) -> Result<Self, SettingsError> {
        settings::load(file, overrides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_defaults_are_a_complete_configuration() {
        Config::load(None, &[]).unwrap();
    }

    #[test]
    fn every_built_in_profile_is_a_configuration() {
        for profile in Profile::ALL {
            Config::load_over(profile, None, &[]).unwrap_or_else(|error| panic!("{profile}: {error}"));
        }
    }

    #[test]
    fn every_shipped_profile_is_a_configuration() {
        let profiles = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/profiles");
        for entry in std::fs::read_dir(profiles).unwrap() {
            let path = entry.unwrap().path();
            Config::load(Some(&path), &[]).unwrap_or_else(|error| panic!("{error}"));
        }
    }
}
