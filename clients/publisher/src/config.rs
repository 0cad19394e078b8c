//! The sections of `config/server.toml` that a cart reads.

use std::path::Path;

use config::{Config, File, FileFormat};
use recording::RecordingConfig;
use serde::Deserialize;

use crate::CartError;

const DEFAULTS: &str = include_str!("../../../config/server.toml");

/// The cart's options, besides those of its command line.
#[derive(Clone, Debug, Deserialize)]
pub struct CartConfig {
    /// Topics of recordings.
    pub recording: RecordingConfig,
    /// Section `[cart]`.
    pub cart: ConnectionConfig,
}

/// How a cart deals with a server that is away.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConnectionConfig {
    /// Time to the first attempt to connect again; doubles with each failure.
    pub retry_first_s: f64,
    /// Time between attempts, at most.
    pub retry_max_s: f64,
    /// A server that was not reached for this time is given up.
    pub give_up_s: f64,
    /// Time to wait for poses that are still to come, after the last pair.
    pub linger_s: f64,
}

impl CartConfig {
    /// The defaults, with `file` and then `overrides` (`section.key=value`) laid over them.
    ///
    /// # Errors
    /// [`CartError::Config`] names the key or file.
    pub fn load(file: Option<&Path>, overrides: &[(String, String)]) -> Result<Self, CartError> {
        let mut layers = Config::builder().add_source(File::from_str(DEFAULTS, FileFormat::Toml));
        if let Some(path) = file {
            layers = layers.add_source(File::from(path).format(FileFormat::Toml));
        }
        for (key, value) in overrides {
            layers = layers.set_override(key, value.as_str())?;
        }
        Ok(layers.build()?.try_deserialize()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_defaults_suffice_and_single_values_win() {
        let config = CartConfig::load(None, &[("cart.linger_s".into(), "9.5".into())]).unwrap();
        assert_eq!(config.cart.linger_s, 9.5);
        assert!(config.recording.topics.left_image.starts_with('/'));
    }
}
