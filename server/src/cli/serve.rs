//! `mis-slam serve`: the server that carts and viewers connect to.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use gpu::Gpu;
use mis_slam_view::window::{self, ModelEvent, WindowOptions};
use mis_slam_view::{Look, Stereo, ViewControl};
use render::Coloring;

use super::{Failure, Outcome};
use crate::config::Config;
use crate::local_view::LocalView;
use crate::service::{Service, ServiceConfig, ServiceError};
use crate::session::gpu_engine::GpuEngine;

/// Size of the window that --view opens.
const WINDOW_PX: (u32, u32) = (1280, 960);

/// Serve sessions over HTTP, WebSocket and zenoh until SIGTERM or Ctrl-C.
#[derive(Debug, Args)]
pub struct Serve {
    /// Also opens a window on the session that was opened last, which draws the model from the buffers that it lives in.
    #[arg(long)]
    view: bool,
    /// Also write what each thread and the GPU did when, for ui.perfetto.dev or about:tracing; grows by some 20 kB a pair.
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
}

impl Serve {
    pub(super) fn trace(&self) -> Option<&Path> {
        self.trace.as_deref()
    }

    pub(super) fn run(&self, config: &Config) -> Outcome {
        let (engine, gpu) = engine(config)?;
        if self.view { run_with_window(config, engine, gpu) } else { serve(config, engine) }
    }
}

fn serve(config: &Config, engine: GpuEngine) -> Outcome {
    runtime()?
        .block_on(async {
            let service = Service::bind(&ServiceConfig::from(config), Arc::new(engine)).await?;
            announce(&service).await?;
            service.run(stop_signal()).await
        })
        .map_err(Failure::failed)
}

/// The window has the main thread, as windows must; the server goes on after it was closed.
fn run_with_window(config: &Config, engine: GpuEngine, gpu: Arc<Gpu>) -> Outcome {
    let (events, proxy) = window::event_loop().map_err(Failure::failed)?;
    let redraw = proxy.clone();
    let view = LocalView::new(move || {
        // The window may have been closed already.
        let _ = redraw.send_event(ModelEvent::Changed);
    });
    let weight_max = config.dense.fusion.weight_max;
    let shown = view.shown(&gpu, engine.turns(), weight_max).map_err(Failure::failed)?;
    let engine = engine.observed_by(move |session| view.observer(session));
    let config = config.clone();
    let serving = std::thread::spawn(move || {
        let served = serve(&config, engine);
        let _ = proxy.send_event(ModelEvent::Ended);
        served
    });
    let options = WindowOptions {
        title: "MIS-SLAM".into(),
        size_px: WINDOW_PX,
        full_screen: false,
        pictures: "model.png".into(),
    };
    let look = Look { coloring: Coloring::Colour, stereo: Stereo::Off, eye_separation_m: None, plain: false };
    if let Err(error) = window::run(events, gpu, shown, (ViewControl::new(false), look), options) {
        tracing::error!(%error, "the window has closed, the server goes on");
    }
    serving.join().map_err(|_| Failure::failed("the server panicked"))?
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
