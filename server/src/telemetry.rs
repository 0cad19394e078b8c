//! Logging, set up once for the process.

use tracing_subscriber::EnvFilter;

/// Starts logging to standard error. `RUST_LOG` chooses what is logged; a server says more by default than a
/// one-off command does.
pub fn start(serving: bool) {
    let default = if serving { "info,zenoh=warn,wgpu_hal=error" } else { "warn,wgpu_hal=error" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
}
