//! `mis-slam serve`: the server that carts and viewers connect to.

use std::io::Write;
use std::sync::Arc;

use clap::Args;
use gpu::Gpu;

use super::{Failure, Outcome};
use crate::config::Config;
use crate::service::{Service, ServiceConfig, ServiceError};
use crate::session::gpu_engine::GpuEngine;

/// Serve sessions over HTTP, WebSocket and zenoh until SIGTERM or Ctrl-C.
#[derive(Debug, Args)]
pub struct Serve {}

impl Serve {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let (engine, _) = engine(config)?;
        runtime()?
            .block_on(async {
                let service = Service::bind(&ServiceConfig::from(config), Arc::new(engine)).await?;
                announce(&service).await?;
                service.run(stop_signal()).await
            })
            .map_err(Failure::failed)
    }
}

/// The reconstruction of every session, on the configured GPU.
pub(super) fn engine(config: &Config) -> Result<(GpuEngine, Arc<Gpu>), Failure> {
    let gpu = Arc::new(Gpu::open(&config.gpu.clone().with_environment()).map_err(Failure::failed)?);
    tracing::info!(adapter = %gpu.description().name, "reconstructing");
    Ok((GpuEngine::new(Arc::clone(&gpu), config), gpu))
}

pub(super) fn runtime() -> Result<tokio::runtime::Runtime, Failure> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build().map_err(Failure::failed)
}

/// One line per address on standard output, for people and scripts.
async fn announce(service: &Service) -> Result<(), ServiceError> {
    let mut lines = vec![format!("http http://{}", service.address()?)];
    lines.extend(service.zenoh_endpoints().await.iter().map(|endpoint| format!("zenoh {endpoint}")));
    let mut out = std::io::stdout().lock();
    for line in lines {
        writeln!(out, "{line}")?;
    }
    Ok(out.flush()?)
}

/// Resolves on SIGTERM or Ctrl-C.
pub(super) async fn stop_signal() {
    let interrupt = tokio::signal::ctrl_c();
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        match signal(SignalKind::terminate()) {
            Ok(mut terminate) => tokio::select! {
                _ = terminate.recv() => {}
                _ = interrupt => {}
            },
            Err(error) => {
                tracing::warn!(%error, "SIGTERM will not drain");
                let _ = interrupt.await;
            }
        }
    }
    #[cfg(not(unix))]
    let _ = interrupt.await;
    tracing::info!("stopping");
}
