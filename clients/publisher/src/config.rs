//! The sections of `config/server.toml` that a cart reads.

use std::path::Path;

use geometry::RigLimits;
use recording::RecordingConfig;
use serde::Deserialize;

use crate::CartError;

/// The cart's options, besides those of its command line.
#[derive(Clone, Debug, Deserialize)]
pub struct CartConfig {
    /// Topics of recordings.
    pub recording: RecordingConfig,
    /// Which calibrations are sent.
    pub rig: RigLimits,
    /// Section `[cart]`.
    pub cart: ConnectionConfig,
}

/// How a cart deals with a server that is away.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConnectionConfig {
    /// Pairs that wait while the connection is slow or away; then the oldest are skipped.
    pub buffer_pairs: usize,
    /// JPEG quality of images that come as something else, 1 to 100.
    pub jpeg_quality: u8,
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
    pub fn load(file: Option<&Path>, overrides: &[String]) -> Result<Self, CartError> {
        Ok(settings::load(file, overrides)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_defaults_suffice_and_single_values_win() {
        let config = CartConfig::load(None, &["cart.linger_s=9.5".into()]).unwrap();
        assert_eq!(config.cart.linger_s, 9.5);
        assert!(config.recording.topics.left_image.starts_with('/'));
    }
}
