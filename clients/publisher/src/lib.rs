//! A scope cart in software: streams the stereo pairs of a recording or folder to a reconstruction server, at the pace of
//! their stamps, over WebSocket or zenoh.
//!
//! The network never holds the pairs up: they wait a bounded while for the connection, then the oldest are skipped and
//! counted.

mod config;
mod convert;
mod error;
mod link;
mod open;
mod publish;
mod queue;
mod report;
mod source;

pub use config::{CartConfig, ConnectionConfig};
pub use convert::{Encoding, image_to_wire};
pub use error::CartError;
pub use protocol::Endpoint;
pub use publish::{PublishOptions, publish_recording};
pub use report::{Latency, Progress, PublishReport};
