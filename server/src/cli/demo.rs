//! `mis-slam demo`: a simulated liver through the whole system, live in the browser.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use gpu::Gpu;
use mis_slam_cart::{
    CartConfig, Encoding as ImageEncoding, Endpoint, PublishOptions, PublishReport, publish_recording,
};
use recording::PairingStatistics;
use simulator::SceneKind;
use tokio::sync::oneshot;

use super::progress::Progress;
use super::{Failure, Outcome, replay, serve};
use crate::config::Config;
use crate::replay::collector::{Collector, Running};
use crate::replay::files::{self, Run};
use crate::replay::truth::PointTruth;
use crate::service::{Service, ServiceConfig};
use crate::simulated::{self, Encoding};

const ENCODING: Encoding = Encoding { jpeg_quality: 90, depth_every: 30 };

/// Pace on software Vulkan, times the scene's own.
const SOFTWARE_RATE: f64 = 0.05;

/// Simulate a short liver scene, stream it through the server's own ingest, show it on the page.
#[derive(Debug, Args)]
pub struct Demo {
    /// End by itself after one pass, with a report and a picture of the model.
    #[arg(long)]
    headless: bool,
    /// Pairs in the scene.
    #[arg(long, default_value_t = 120, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    /// Where a headless demo leaves model.png, model.ply, trajectory.tum and report.json.
    #[arg(long, value_name = "DIR", default_value = "demo-results")]
    out: PathBuf,
}

impl Demo {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let scratch = tempfile::tempdir().map_err(Failure::failed)?;
        let mut config = config.clone();
        // The demo leaves nothing behind but what it says.
        config.storage.directory = PathBuf::new();
        let config = &config;
        let recording = scratch.path().join("demo.mcap");
        simulate(self.frames, &recording, config)?;
        if self.headless { self.run_headless(config, &recording) } else { run_with_page(config, recording) }
    }

    fn run_headless(&self, config: &Config, recording: &Path) -> Outcome {
        std::fs::create_dir_all(&self.out)
            .map_err(|error| Failure::failed(format!("{}: {error}", self.out.display())))?;
        let started = Instant::now();
        let collector = Arc::new(Collector::new(Running::default(), None, PointTruth::default()));
        let (engine, gpu) = serve::engine(config)?;
        let observer = Arc::clone(&collector);
        let engine = Arc::new(engine.observed_by(move |_| Arc::clone(&observer) as _));
        let mut loopback = config.clone();
        loopback.server.listen.set_port(0);
        loopback.zenoh.enabled = false;
        let rate = rate(&gpu);
        let options = |to| PublishOptions { rate, ..publish_options(recording.into(), to) };
        let published = serve::runtime()?.block_on(stream(&loopback, engine, options))?;
        let collector =
            Arc::into_inner(collector).ok_or_else(|| Failure::failed("the session did not end in time"))?;
        let statistics = PairingStatistics { pairs: published.sent, ..PairingStatistics::default() };
        let run = Run {
            gpu: &gpu,
            recording: None,
            statistics: &statistics,
            truncated: false,
            wall: started.elapsed(),
        };
        let collected = collector.into_collected();
        if let Some(error) = collected.error {
            return Err(Failure::failed(error));
        }
        let report = files::write(&self.out, &collected, &run).map_err(Failure::failed)?;
        replay::print_summary(&report);
        println!("picture          {}", self.out.join("model.png").display());
        Ok(())
    }
}

/// Software Vulkan takes about a second a pair: there the scene runs slowly, so that most of it is fused.
fn rate(gpu: &Gpu) -> f64 {
    if gpu.description().kind == "software" { SOFTWARE_RATE } else { 1.0 }
}

fn simulate(frames: u32, recording: &Path, config: &Config) -> Outcome {
    let scene = simulator::SceneConfig { scene: SceneKind::Liver, frames, ..config.simulate.clone() };
    let mut progress = Progress::new("simulate");
    let recorded = simulated::record(&scene, &ENCODING, recording, &config.recording, &mut |done, total| {
        progress.set(done, Some(total));
    });
    progress.finish();
    recorded.map_err(Failure::failed)
}

/// Serves, streams one pass over loopback, drains.
async fn stream(
    config: &Config,
    engine: Arc<crate::session::gpu_engine::GpuEngine>,
    options: impl FnOnce(Endpoint) -> PublishOptions,
) -> Result<PublishReport, Failure> {
    let service = Service::bind(&ServiceConfig::from(config), engine).await.map_err(Failure::failed)?;
    let options = options(endpoint(&service)?);
    let (stop, stopped) = oneshot::channel::<()>();
    let serving = tokio::spawn(service.run(async {
        let _ = stopped.await;
    }));
    let published = publish(&options, config, std::future::pending()).await;
    drop(stop);
    serving.await.map_err(Failure::failed)?.map_err(Failure::failed)?;
    published
}

fn run_with_page(config: &Config, recording: PathBuf) -> Outcome {
    let (engine, gpu) = serve::engine(config)?;
    serve::runtime()?.block_on(async {
        let service =
            Service::bind(&ServiceConfig::from(config), Arc::new(engine)).await.map_err(Failure::failed)?;
        let address = service.address().map_err(Failure::failed)?;
        let to = endpoint(&service)?;
        println!("open http://{address} in a browser; Ctrl-C ends the demo");
        let serving = tokio::spawn(service.run(serve::stop_signal()));
        let options = PublishOptions { rate: rate(&gpu), repeat: true, ..publish_options(recording, to) };
        let published = publish(&options, config, serve::stop_signal()).await;
        let served = serving.await.map_err(Failure::failed)?.map_err(Failure::failed);
        published.and(served)
    })
}

/// One pass at the recorded pace, as a session of its own.
fn publish_options(source: PathBuf, to: Endpoint) -> PublishOptions {
    PublishOptions {
        source,
        rig_file: None,
        encoding: ImageEncoding::Unchanged,
        to,
        session: None,
        takeover_token: None,
        rate: 1.0,
        repeat: false,
    }
}

/// The server's own address, as a cart on this machine reaches it.
fn endpoint(service: &Service) -> Result<Endpoint, Failure> {
    let port = service.address().map_err(Failure::failed)?.port();
    format!("ws://127.0.0.1:{port}").parse().map_err(Failure::failed)
}

async fn publish(
    options: &PublishOptions,
    config: &Config,
    stop: impl Future<Output = ()> + Send,
) -> Result<PublishReport, Failure> {
    let cart = CartConfig { recording: config.recording.clone(), rig: config.rig, cart: config.cart.clone() };
    let mut bar = Progress::new("stream");
    let observe = |progress: &mis_slam_cart::Progress| {
        if !options.repeat {
            bar.set(progress.sent, progress.expected);
        }
    };
    let published = publish_recording(options, &cart, observe, stop).await.map_err(Failure::failed);
    bar.finish();
    published
}
