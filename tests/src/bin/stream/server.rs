//! A real server on loopback with the player in the place of a reconstruction.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use mis_slam::config::Config;
use mis_slam::service::{Service, ServiceConfig, ServiceError};
use mis_slam::session::registry::{FeedWanted, Opening};
use protocol::v1::{Calibration, Camera, RectifiedRig};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::engine::{Player, Sent};
use crate::error::StreamError;
use crate::selection::Run;

/// Session that is played.
pub const SESSION: &str = "bench";

/// A running server.
pub struct BenchServer {
    pub address: SocketAddr,
    go: Arc<AtomicBool>,
    sent: Arc<Mutex<Vec<Sent>>>,
    stop: oneshot::Sender<()>,
    running: JoinHandle<Result<(), ServiceError>>,
    duration: Duration,
}

impl BenchServer {
    /// A server with one session that waits to be played.
    pub async fn start(run: &Arc<Run>, rate_hz: f64) -> Result<Self, StreamError> {
        let mut config = ServiceConfig::from(&Config::load(None, &[])?);
        config.server.listen = SocketAddr::from(([127, 0, 0, 1], 0));
        config.zenoh.enabled = false;
        config.storage.directory = String::new().into();
        let (go, sent) = (Arc::new(AtomicBool::new(false)), Arc::default());
        let player = Player {
            run: Arc::clone(run),
            rate_hz,
            weight_max: 20.0,
            go: Arc::clone(&go),
            sent: Arc::clone(&sent),
        };
        let service = Service::bind(&config, Arc::new(player)).await?;
        let address = service.address()?;
        let registry = Arc::clone(service.registry());
        let (stop, stopped) = oneshot::channel::<()>();
        let running = tokio::spawn(service.run(async move {
            let _ = stopped.await;
        }));
        let feed = FeedWanted::Cart(Box::new(calibration()));
        let opening = Opening { id: SESSION.parse().ok(), record: false, feed };
        let open = move || registry.open(&opening).map(|_| ());
        if tokio::task::spawn_blocking(open).await?.is_err() {
            return Err(StreamError::Closed);
        }
        let duration = Duration::from_secs_f64(run.frames.len() as f64 / rate_hz);
        Ok(Self { address, go, sent, stop, running, duration })
    }

    /// Plays the run.
    pub fn play(&self) {
        self.go.store(true, Ordering::Release);
    }

    /// How long that takes.
    pub fn duration(&self) -> Duration {
        self.duration
    }

    /// What has been sent so far.
    pub fn sent(&self) -> Vec<Sent> {
        self.sent.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Stops it.
    pub async fn stop(self) -> Result<(), StreamError> {
        // It may have stopped by itself, which its result says.
        let _ = self.stop.send(());
        Ok(self.running.await??)
    }
}

fn calibration() -> Calibration {
    let left = Camera { width_px: 64, height_px: 48, fx_px: 60.0, fy_px: 60.0, cx_px: 32.0, cy_px: 24.0 };
    let rig = RectifiedRig { left: Some(left), baseline_m: 0.005, right_cx_px: 32.0 };
    Calibration { rectified: Some(rig), raw: None }
}
