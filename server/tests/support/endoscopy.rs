//! A session that computes on the GPU, fed with simulated endoscopy.

use std::sync::Arc;
use std::time::{Duration, Instant};

use gpu::Gpu;
use mis_slam::config::Config;
use mis_slam::session::gpu_engine::GpuEngine;
use protocol::v1::{self, to_server};
use recording::{Calibration, RecordingReader, StereoMessage};
use serde_json::json;
use simulator::SceneConfig;
use tempfile::TempDir;

use super::{Client, TestServer, pose};

/// Nothing is fused for longer than this only where nothing is going to be.
const PATIENCE: Duration = Duration::from_secs(3);

/// A server with one session, `a`, and the cart that feeds it.
pub struct Endoscopy {
    pub server: TestServer,
    pub gpu: Arc<Gpu>,
    folder: TempDir,
    config: Config,
    cart: Client,
    sequence: u64,
}

/// A tiny rigid liver.
pub fn liver(config: &Config) -> SceneConfig {
    SceneConfig {
        frames: 16,
        fps: 10.0,
        width_px: 320,
        height_px: 240,
        points: 10,
        ..mis_slam::simulated::rigid(&config.simulate)
    }
}

impl Endoscopy {
    /// For pictures as of [`liver`].
    pub async fn start() -> Self {
        let folder = TempDir::new().unwrap();
        let mut config = Config::load(None, &["recording.flush_interval_ms=20".into()]).unwrap();
        config.storage.directory = folder.path().join("data");
        let gpu = Arc::new(Gpu::open(&config.gpu.clone().with_environment()).unwrap());
        let engine = Arc::new(GpuEngine::new(Arc::clone(&gpu), &config));
        let directory = config.storage.directory.clone();
        let server = TestServer::start_on(engine, |service| {
            service.storage.directory = directory;
            service.recording.flush_interval_ms = 20;
        })
        .await;
        let scene = simulate(&folder, &config, &SceneConfig { frames: 1, ..liver(&config) }, "rig");
        let body = json!({"session": "a", "calibration": wire_calibration(&scene)});
        let (status, opened) = server.request("POST", "/api/sessions", Some(body)).await;
        assert_eq!(status, 201, "{opened}");
        let cart = server.join("/api/sessions/a/ingest").await;
        Self { server, gpu, folder, config, cart, sequence: 0 }
    }

    /// The pairs of a scene.
    pub fn pairs(
        &self,
        change: impl FnOnce(SceneConfig) -> SceneConfig,
        name: &str,
    ) -> std::vec::IntoIter<StereoMessage> {
        let reader = simulate(&self.folder, &self.config, &change(liver(&self.config)), name);
        reader.stereo().unwrap().map(Result::unwrap).collect::<Vec<_>>().into_iter()
    }

    /// Sends pairs one after the other, each once the one before has a pose and, where it is going to be, is fused; stamps
    /// go on from one call to the next. The poses.
    pub async fn feed(&mut self, pairs: impl Iterator<Item = StereoMessage>) -> Vec<v1::Pose> {
        let mut poses = Vec::new();
        for pair in pairs {
            let sequence = self.sequence;
            self.sequence += 1;
            let fused = self.frames_fused().await;
            let size_px = (liver(&self.config).width_px, liver(&self.config).height_px);
            let stamped = StereoMessage { stamp_ns: 1_000_000_000 + sequence * 100_000_000, ..pair };
            let pair = mis_slam::convert::pair_to_wire(stamped, sequence, size_px);
            self.cart.say(to_server::Body::Pair(pair)).await;
            let of_pair = |body| pose(body).filter(|pose| pose.sequence == sequence);
            let found = self.cart.hear_until(of_pair).await;
            let patience =
                Instant::now() + if found.world_from_camera.is_some() { PATIENCE } else { Duration::ZERO };
            poses.push(found);
            while self.frames_fused().await == fused && Instant::now() < patience {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        }
        poses
    }

    async fn frames_fused(&self) -> u64 {
        self.server.state("a").await["frames_fused"].as_u64().unwrap()
    }
}

fn simulate(folder: &TempDir, config: &Config, scene: &SceneConfig, name: &str) -> RecordingReader {
    let path = folder.path().join(name).with_extension("mcap");
    let encoding = mis_slam::simulated::Encoding { jpeg_quality: 95, depth_every: 100 };
    mis_slam::simulated::record(scene, &encoding, &path, &config.recording, &mut |_, _| {}).unwrap();
    RecordingReader::open(&path, &config.recording).unwrap()
}

fn wire_calibration(reader: &RecordingReader) -> v1::Calibration {
    let Calibration::Rectified(rig) = reader.calibration().unwrap() else { panic!("a rectified rig") };
    let left = Some(mis_slam::convert::camera_to_wire(&rig.left));
    let rectified = v1::RectifiedRig { left, baseline_m: rig.baseline_m, right_cx_px: rig.right_cx_px };
    v1::Calibration { rectified: Some(rectified), raw: None }
}
