//! A real server on loopback ports, with a computation that tracks everything and adds a surfel for each pair.
#![allow(dead_code, clippy::unwrap_used, clippy::panic, clippy::needless_pass_by_value)]

pub mod endoscopy;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use geometry::Rgb;
use mis_slam::publish::model_lane::ModelUpdate;
use mis_slam::service::{Service, ServiceConfig, ServiceError};
use mis_slam::session::engine::{Engine, EngineError, EngineResults, EngineStart, RunningEngine};
use mis_slam::session::hub::{Hub, PoseUpdate};
use mis_slam::session::mailbox::MailboxReceiver;
use mis_slam::session::registry::Registry;
use mis_slam::session::worker::StereoPair;
use protocol::v1::{self, TrackingOutcome, from_server, to_server};
use protocol::{Bytes, WireSurfel};
use replica::Replica;
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// Nothing here takes so long unless it never ends.
const DEADLINE: Duration = Duration::from_secs(60);

/// Larger bodies are announced, as curl does.
const EXPECTED_MAX: usize = 1 << 20;

pub const SIZE_PX: (u32, u32) = (64, 48);

pub struct TestServer {
    pub address: SocketAddr,
    pub zenoh_endpoints: Vec<String>,
    pub registry: Arc<Registry>,
    stop: Option<oneshot::Sender<()>>,
    running: tokio::task::JoinHandle<Result<(), ServiceError>>,
}

pub fn defaults() -> ServiceConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/server.toml");
    let mut config: ServiceConfig = toml::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    config.server.listen = "127.0.0.1:0".parse().unwrap();
    config.zenoh.enabled = false;
    config.zenoh.listen = vec!["tcp/127.0.0.1:0".into()];
    config.storage.directory = "".into();
    config.storage.free_min_mib = 0;
    config
}

impl TestServer {
    pub async fn start() -> Self {
        Self::start_with(|_| {}).await
    }

    /// Why a server with such a configuration does not start.
    pub async fn refused_with(change: impl FnOnce(&mut ServiceConfig)) -> ServiceError {
        let mut config = defaults();
        change(&mut config);
        match Service::bind(&config, Arc::new(CountingEngine)).await {
            Err(error) => error,
            Ok(_) => panic!("the server starts"),
        }
    }

    pub async fn start_with(change: impl FnOnce(&mut ServiceConfig)) -> Self {
        Self::start_on(Arc::new(CountingEngine), change).await
    }

    /// A server whose sessions compute with another engine.
    pub async fn start_on(engine: Arc<dyn Engine>, change: impl FnOnce(&mut ServiceConfig)) -> Self {
        let mut config = defaults();
        change(&mut config);
        let service = Service::bind(&config, engine).await.unwrap();
        let address = service.address().unwrap();
        let zenoh_endpoints = service.zenoh_endpoints().await;
        let registry = Arc::clone(service.registry());
        let (stop, stopped) = oneshot::channel::<()>();
        let running = tokio::spawn(service.run(async move {
            let _ = stopped.await;
        }));
        Self { address, zenoh_endpoints, registry, stop: Some(stop), running }
    }

    /// Asks the server to stop, as SIGTERM does.
    pub fn stop(&mut self) {
        self.stop.take().expect("stopped once").send(()).unwrap();
    }

    pub async fn ended(self) -> Result<(), ServiceError> {
        within(self.running).await.unwrap()
    }

    pub async fn request(
        &self,
        method: &str,
        path: &str,
        body: Option<serde_json::Value>,
    ) -> (u16, serde_json::Value) {
        self.request_as(None, method, path, body).await
    }

    pub async fn request_as(
        &self,
        token: Option<&str>,
        method: &str,
        path: &str,
        body: Option<serde_json::Value>,
    ) -> (u16, serde_json::Value) {
        let bytes = body.map(|body| body.to_string().into_bytes()).unwrap_or_default();
        let (status, answer) = self.exchange(token, method, path, bytes).await;
        (status, serde_json::from_slice(&answer).unwrap_or_default())
    }

    pub async fn upload(&self, path: &str, bytes: Vec<u8>) -> (u16, serde_json::Value) {
        let (status, answer) = self.exchange(None, "PUT", path, bytes).await;
        (status, serde_json::from_slice(&answer).unwrap_or_default())
    }

    pub async fn download(&self, path: &str) -> (u16, Vec<u8>) {
        self.exchange(None, "GET", path, Vec::new()).await
    }

    async fn exchange(&self, token: Option<&str>, method: &str, path: &str, body: Vec<u8>) -> (u16, Vec<u8>) {
        let url = format!("http://{}{path}", self.address);
        let method = ureq::http::Method::from_bytes(method.as_bytes()).unwrap();
        let authorization = token.map(|token| format!("Bearer {token}"));
        tokio::task::spawn_blocking(move || {
            let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
            let request = ureq::http::Request::builder().method(method).uri(url);
            let request = request.header("content-type", "application/json");
            // A body that is refused by its length is then not sent at all.
            let request =
                if body.len() > EXPECTED_MAX { request.header("expect", "100-continue") } else { request };
            let request = match authorization {
                Some(authorization) => request.header("authorization", authorization),
                None => request,
            };
            let mut response = agent.run(request.body(body).unwrap()).unwrap();
            (response.status().as_u16(), response.body_mut().read_to_vec().unwrap())
        })
        .await
        .unwrap()
    }

    pub async fn open(&self, id: &str) {
        let body = serde_json::json!({"session": id, "calibration": calibration(SIZE_PX)});
        let (status, opened) = self.request("POST", "/api/sessions", Some(body)).await;
        assert_eq!((status, opened["session"].as_str()), (201, Some(id)), "{opened}");
    }

    pub async fn state(&self, id: &str) -> serde_json::Value {
        let (status, state) = self.request("GET", &format!("/api/sessions/{id}"), None).await;
        assert_eq!(status, 200);
        state
    }

    /// The state, once it is as wanted.
    pub async fn state_when(
        &self,
        id: &str,
        wanted: impl Fn(&serde_json::Value) -> bool,
    ) -> serde_json::Value {
        within(async {
            loop {
                let state = self.state(id).await;
                if wanted(&state) {
                    return state;
                }
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await
    }

    /// As [`Self::state_when`], and the session may be yet to open.
    pub async fn state_when_open(&self, id: &str, wanted: impl Fn(&serde_json::Value) -> bool) {
        within(async {
            while self.request("GET", &format!("/api/sessions/{id}"), None).await.0 != 200 {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await;
        self.state_when(id, wanted).await;
    }

    pub async fn connect(&self, path: &str) -> Client {
        let (socket, _) = connect_async(format!("ws://{}{path}", self.address)).await.unwrap();
        Client { socket }
    }

    /// A client of the server's zenoh that looks for no others.
    pub async fn zenoh_client(&self) -> zenoh::Session {
        within(connection::zenoh::open(&self.zenoh_endpoints[0])).await.unwrap()
    }

    /// A greeted connection.
    pub async fn join(&self, path: &str) -> Client {
        let mut client = self.connect(path).await;
        client.say(to_server::Body::Hello(protocol::hello("test"))).await;
        let answer = client.hear().await;
        assert!(matches!(answer, from_server::Body::Hello(_)), "{answer:?}");
        client
    }

    /// Status of a refused upgrade.
    pub async fn refused_upgrade(&self, path: &str) -> u16 {
        refusal_status(format!("ws://{}{path}", self.address)).await
    }
}

/// Status of a refused upgrade.
pub async fn refusal_status(request: impl IntoClientRequest + Unpin) -> u16 {
    match connect_async(request).await {
        Err(Error::Http(response)) => response.status().as_u16(),
        other => panic!("{other:?}"),
    }
}

pub struct Client {
    pub socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
}

impl Client {
    pub async fn say(&mut self, body: to_server::Body) {
        self.socket.send(Message::Binary(protocol::to_server(body, None))).await.unwrap();
    }

    /// The next message, or the close code.
    pub async fn next(&mut self) -> Result<from_server::Body, u16> {
        loop {
            match within(self.socket.next()).await {
                Some(Ok(Message::Binary(bytes))) => {
                    return Ok(protocol::decode_from_server(bytes).unwrap().body.unwrap());
                }
                Some(Ok(Message::Close(Some(frame)))) => return Err(frame.code.into()),
                Some(Ok(_)) => {}
                other => panic!("the connection ended without a close frame: {other:?}"),
            }
        }
    }

    pub async fn hear(&mut self) -> from_server::Body {
        self.next().await.expect("no close")
    }

    /// The first message that is wanted; others are passed over.
    pub async fn hear_until<T>(&mut self, wanted: impl Fn(from_server::Body) -> Option<T>) -> T {
        loop {
            if let Some(found) = wanted(self.hear().await) {
                return found;
            }
        }
    }

    pub async fn hear_refusal(&mut self) -> v1::Refusal {
        self.hear_until(refusal).await
    }

    /// What was refused before the close, and the close code.
    pub async fn hear_close(&mut self) -> (Option<from_server::Body>, u16) {
        let mut last = None;
        loop {
            match self.next().await {
                Ok(body) => last = Some(body),
                Err(code) => return (last, code),
            }
        }
    }

    /// Follows the model lane until the model is as wanted.
    pub async fn follow_model(&mut self, model: &mut Replica, wanted: impl Fn(&Replica) -> bool) {
        while !wanted(model) {
            match self.hear().await {
                from_server::Body::Snapshot(chunk) => drop(model.take_chunk(&chunk).unwrap()),
                from_server::Body::Epoch(epoch) => drop(model.take_epoch(&epoch).unwrap()),
                _ => {}
            }
        }
    }
}

/// The message that zenoh brought.
pub fn decode(payload: &zenoh::bytes::ZBytes) -> from_server::Body {
    protocol::decode_from_server(Bytes::from(payload.to_bytes().into_owned())).unwrap().body.unwrap()
}

pub fn refusal(body: from_server::Body) -> Option<v1::Refusal> {
    if let from_server::Body::Refusal(refusal) = body { Some(refusal) } else { None }
}

pub fn pose(body: from_server::Body) -> Option<v1::Pose> {
    if let from_server::Body::Pose(pose) = body { Some(pose) } else { None }
}

pub async fn within<T>(future: impl IntoFuture<Output = T>) -> T {
    tokio::time::timeout(DEADLINE, future.into_future()).await.expect("it ends")
}

pub fn calibration((width_px, height_px): (u32, u32)) -> v1::Calibration {
    let left = v1::Camera {
        width_px,
        height_px,
        fx_px: 60.0,
        fy_px: 60.0,
        cx_px: f64::from(width_px) / 2.0,
        cy_px: f64::from(height_px) / 2.0,
    };
    let rig = v1::RectifiedRig { left: Some(left), baseline_m: 0.005, right_cx_px: left.cx_px };
    v1::Calibration { rectified: Some(rig), raw: None }
}

pub fn jpeg((width_px, height_px): (u32, u32)) -> v1::EncodedImage {
    let picture = Rgb::from_fn(width_px, height_px, |x, y| [(x * 3) as u8, (y * 5) as u8, 90]);
    let data = recording::encode_jpeg(&picture, 80).unwrap().bytes.into();
    v1::EncodedImage { format: v1::ImageFormat::Jpeg.into(), width_px, height_px, data }
}

pub fn wire_pair(sequence: u64) -> v1::StereoPair {
    v1::StereoPair {
        stamp_ns: 1_000_000_000 + sequence * 33_000_000,
        sequence,
        left: Some(jpeg(SIZE_PX)),
        right: Some(jpeg(SIZE_PX)),
        mask: None,
    }
}

/// Tracks every pair at the identity and adds a surfel for it.
struct CountingEngine;

struct CountingThread(JoinHandle<()>);

impl Engine for CountingEngine {
    fn start(
        &self,
        _: &EngineStart,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError> {
        let count = move || {
            let mut id = 0;
            while let Some(pair) = pairs.take() {
                id += 1;
                publish(&hub, &pair, id);
            }
        };
        Ok(Box::new(CountingThread(std::thread::spawn(count))))
    }
}

impl RunningEngine for CountingThread {
    fn join(self: Box<Self>) -> Option<EngineResults> {
        self.0.join().unwrap();
        None
    }
}

fn publish(hub: &Hub, pair: &StereoPair, id: u32) {
    publish_pose(hub, pair);
    hub.count_fused();
    let surfel = WireSurfel {
        id,
        position_in_world_m: [id as f32 * 1e-3, 0.0, 0.1],
        normal_in_world: [0.0, 0.0, -1.0],
        radius_m: 0.001,
        color: [180, 90, 80],
        confidence: 1.0,
    };
    let update = ModelUpdate { stamp_ns: pair.stamp_ns, changed: vec![surfel], ..ModelUpdate::default() };
    hub.publish_model(&update).unwrap();
}

/// Says that a pair was tracked, with the camera at the origin.
pub fn publish_pose(hub: &Hub, pair: &StereoPair) {
    hub.publish_pose(&PoseUpdate {
        stamp_ns: pair.stamp_ns,
        sequence: pair.sequence,
        outcome: TrackingOutcome::Tracked,
        world_from_camera: Some(v1::RigidTransform { qw: 1.0, ..v1::RigidTransform::default() }),
        matched_features: 100,
        lost_for_ns: 0,
        picture: "good",
    });
}
