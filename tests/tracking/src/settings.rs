//! The sections of the server's configuration that concern the tracker.

use config::{Config, File, FileFormat};
use recording::RecordingConfig;
use simulator::SceneConfig;
use tracking::TrackingConfig;

use crate::Error;

/// What the server would run with.
pub struct Settings {
    /// The tracker's.
    pub tracking: TrackingConfig,
    /// The tracker's, for vehicles.
    pub driving: TrackingConfig,
    /// Of recordings.
    pub recording: RecordingConfig,
    /// Of simulated scenes.
    pub scene: SceneConfig,
}

impl Settings {
    /// `config/server.toml`, with single values (`section.key=value`) over it.
    ///
    /// # Errors
    /// A value that is no configuration.
    pub fn load(overrides: &[String]) -> Result<Self, Error> {
        let usual = layered(&[], overrides)?;
        let driving = layered(&["config/profiles/driving.toml"], overrides)?;
        Ok(Self {
            tracking: usual.get("tracking")?,
            driving: driving.get("tracking")?,
            recording: usual.get("recording")?,
            scene: usual.get("simulate")?,
        })
    }
}

fn layered(profiles: &[&str], overrides: &[String]) -> Result<Config, Error> {
    let root = crate::footage::workspace();
    let mut layers = Config::builder();
    for name in ["config/server.toml"].iter().chain(profiles) {
        layers = layers.add_source(File::from(root.join(name)));
    }
    for text in overrides {
        layers = layers.add_source(File::from_str(text, FileFormat::Toml));
    }
    Ok(layers.build()?)
}
