//! What comes in: stereo pairs and calibrations, over WebSocket and zenoh.

use serde::Deserialize;

pub mod decode;
pub mod socket;
pub mod zenoh;
mod zenoh_requests;

/// Section `[zenoh]` of the configuration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZenohConfig {
    /// Whether the server is a zenoh peer at all.
    pub enabled: bool,
    /// Endpoints that it listens on, such as `tcp/0.0.0.0:7447`.
    pub listen: Vec<String>,
    /// Routers and peers that it connects to.
    pub connect: Vec<String>,
}
