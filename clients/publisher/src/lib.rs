//! A scope cart in software: streams the stereo pairs of a recording to a reconstruction server, at the pace of their
//! stamps, over WebSocket or zenoh.
//!
//! The network never holds the pairs up: a pair that cannot leave before the next one is due is skipped and counted.

mod config;
mod convert;
mod endpoint;
mod error;
mod link;
mod publish;
mod report;
mod source;

pub use config::{CartConfig, ConnectionConfig};
pub use endpoint::Endpoint;
pub use error::CartError;
pub use publish::{PublishOptions, publish_recording};
pub use report::{Latency, Progress, PublishReport};
