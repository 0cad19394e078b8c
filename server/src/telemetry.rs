//! Logging and tracing, set up once for the process.

use std::path::Path;
use std::sync::Arc;

use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer};

use crate::trace::{self, TraceError, TraceFile, TraceLayer};

/// Starts logging to standard error. `RUST_LOG` chooses what is logged; a server says more by default than a
/// one-off command does. With `trace` what the stages do is also written there, until that is finished.
///
/// # Errors
/// [`TraceError`] where the file cannot be written.
pub fn start(serving: bool, trace: Option<&Path>) -> Result<Option<Arc<TraceFile>>, TraceError> {
    // Zenoh's routing warns at each start that gossip is off, as we set it.
    let quiet = "zenoh::net::routing=error,wgpu_hal=error";
    let default = if serving { format!("info,zenoh=warn,{quiet}") } else { format!("warn,{quiet}") };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    let file = trace.map(TraceFile::create).transpose()?.map(Arc::new);
    let log = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).with_filter(filter);
    let timeline = file.clone().map(|file| TraceLayer::new(file).with_filter(trace::stages()));
    tracing_subscriber::registry().with(log).with(timeline).init();
    Ok(file)
}
