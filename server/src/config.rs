//! The configuration: `config/server.toml` built in, a file over it, single values over both.

use std::path::{Path, PathBuf};

use config::{Config as Layers, File, FileFormat};
use serde::Deserialize;

/// The defaults, the same text that documents them.
const DEFAULTS: &str = include_str!("../../config/server.toml");

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
    /// What viewers get.
    pub publish: crate::publish::PublishConfig,
}

/// A configuration that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// `--set` without a key or a value.
    #[error("--set {0}: expected section.key=value")]
    Override(String),
    /// A file that cannot be read, an unknown key, a value of the wrong kind.
    #[error("configuration{}: {source}", .file.as_ref().map(|f| format!(" ({})", f.display())).unwrap_or_default())]
    Layers {
        /// The file laid over the defaults, if any.
        file: Option<PathBuf>,
        /// What is wrong; names the key.
        source: config::ConfigError,
    },
}

impl Config {
    /// The defaults, with `file` and then `overrides` (`section.key=value`) laid over them.
    ///
    /// # Errors
    /// [`ConfigError`] names the key or file.
    pub fn load(file: Option<&Path>, overrides: &[String]) -> Result<Self, ConfigError> {
        let failed = |source| ConfigError::Layers { file: file.map(Path::to_path_buf), source };
        let mut layers = Layers::builder().add_source(File::from_str(DEFAULTS, FileFormat::Toml));
        if let Some(path) = file {
            layers = layers.add_source(File::from(path).format(FileFormat::Toml));
        }
        for text in overrides {
            layers = layers.add_source(File::from_str(&override_as_toml(text)?, FileFormat::Toml));
        }
        layers.build().and_then(Layers::try_deserialize).map_err(failed)
    }
}

/// `section.key=value` as a line of TOML; what is no TOML value is taken as a text.
fn override_as_toml(text: &str) -> Result<String, ConfigError> {
    let (key, value) = text.split_once('=').ok_or_else(|| ConfigError::Override(text.into()))?;
    let plain = format!("{key} = {value}");
    let quoted = format!("{key} = {}", toml::Value::from(value.trim()));
    let parses = |line: &String| line.parse::<toml::Table>().is_ok();
    [plain, quoted].into_iter().find(parses).ok_or_else(|| ConfigError::Override(text.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_defaults_are_a_complete_configuration() {
        Config::load(None, &[]).unwrap();
    }

    #[test]
    fn every_shipped_profile_is_a_configuration() {
        let profiles = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/profiles");
        for entry in std::fs::read_dir(profiles).unwrap() {
            let path = entry.unwrap().path();
            Config::load(Some(&path), &[]).unwrap_or_else(|error| panic!("{error}"));
        }
    }

    #[test]
    fn single_values_win_over_files_and_files_over_defaults() {
        let file = tempfile::NamedTempFile::with_suffix(".toml").unwrap();
        std::fs::write(file.path(), "[quality]\ndark_level = 20\nsharpness_window = 9\n").unwrap();
        let config = Config::load(Some(file.path()), &["quality.dark_level=30".into()]).unwrap();
        assert_eq!((config.quality.dark_level, config.quality.sharpness_window), (30, 9));
    }

    #[test]
    fn lists_and_texts_can_be_overridden() {
        let config =
            Config::load(None, &["zenoh.listen=[\"tcp/[::1]:0\"]".into(), "gpu.adapter=llvmpipe".into()]);
        let config = config.unwrap();
        assert_eq!(config.zenoh.listen, ["tcp/[::1]:0"]);
        assert_eq!(config.gpu.adapter, "llvmpipe");
    }

    #[test]
    fn an_unknown_key_is_refused_by_name() {
        let error = Config::load(None, &["quality.darkness=3".into()]).unwrap_err();
        assert!(error.to_string().contains("darkness"), "{error}");
    }

    #[test]
    fn a_value_of_the_wrong_kind_is_refused_by_name() {
        let error = Config::load(None, &["quality.dark_level=bright".into()]).unwrap_err();
        assert!(error.to_string().contains("dark_level"), "{error}");
    }

    #[test]
    fn an_override_without_a_value_is_refused() {
        assert!(matches!(Config::load(None, &["quality.dark_level".into()]), Err(ConfigError::Override(_))));
    }
}
