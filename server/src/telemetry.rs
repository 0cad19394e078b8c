//! Logging, set up once for the process.

use tracing_subscriber::EnvFilter;

/// Starts logging to standard error. `RUST_LOG` chooses what is logged; a server says more by default than a
/// one-off command does.
pub fn start(serving: bool) {
    // Zenoh's routing warns at each start that gossip is off, as we set it.
    let quiet = "zenoh::net::routing=error,wgpu_hal=error";
    let default = if serving { format!("info,zenoh=warn,{quiet}") } else { format!("warn,{quiet}") };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
}
