//! The HTTP server: API, streams, the embedded page; bound, run, drained.

use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{DefaultBodyLimit, State};
use axum::http::StatusCode;
use axum::middleware;
use axum::{Json, Router};
use protocol::routes;
use serde::Deserialize;
use serde_json::Value;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc};

use self::access::Access;
use self::metrics::Metrics;
use self::openapi::{Api, delete, get, post, put};
use crate::session::registry::Registry;
use crate::storage::{FinishedRun, StoredRecording};

pub mod access;
mod api;
mod downloads;
mod error;
mod finished;
mod metrics;
mod openapi;
pub mod page;
mod picture;
mod recordings;
mod replay;
mod security;
pub mod socket;
mod upgrade;

pub(crate) use error::off_runtime;

/// Body of a request that opens a session, at most.
const BODY_MAX_BYTES: usize = 64 << 10;

/// Section `[server]` of the configuration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServerConfig {
    /// Address and port of the HTTP server; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Largest message that a cart may send.
    pub message_max_mib: f64,
    /// After a signal to stop, all streams are closed within this time.
    pub drain_s: f64,
}

impl ServerConfig {
    /// [`Self::message_max_mib`] in bytes.
    pub fn message_max_bytes(&self) -> usize {
        (self.message_max_mib * f64::from(1 << 20)) as usize
    }
}

/// What request handlers share.
#[derive(Clone)]
struct App {
    registry: Arc<Registry>,
    message_max_bytes: usize,
    viewer_stall: Duration,
    access: Arc<Access>,
    metrics: Arc<Metrics>,
    document: Arc<Value>,
    /// Whoever draws a stored model holds it.
    stored_pictures: Arc<Semaphore>,
    /// Held by every open WebSocket; the server waits for all of them at its end.
    streams: mpsc::Sender<()>,
}

/// A bound HTTP server.
pub struct HttpServer {
    listener: TcpListener,
    config: ServerConfig,
    registry: Arc<Registry>,
    access: Arc<Access>,
    viewer_stall: Duration,
}

impl HttpServer {
    /// Binds the address.
    ///
    /// # Errors
    /// The system's, where the address cannot be had.
    pub async fn bind(
        config: &ServerConfig,
        registry: Arc<Registry>,
        (access, viewer_stall): (Access, Duration),
    ) -> std::io::Result<Self> {
        let listener = TcpListener::bind(config.listen).await?;
        let access = Arc::new(access);
        Ok(Self { listener, config: config.clone(), registry, access, viewer_stall })
    }

    /// The address, its port filled in.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> std::io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Serves until `shutdown`; then refuses new work, tells all streams, waits for them within the drain time.
    ///
    /// # Errors
    /// The system's.
    pub async fn run(self, shutdown: impl Future<Output = ()> + Send + 'static) -> std::io::Result<()> {
        let (streams, mut open_streams) = mpsc::channel(1);
        let (api, document) = documented();
        let app = App {
            registry: Arc::clone(&self.registry),
            message_max_bytes: self.config.message_max_bytes(),
            viewer_stall: self.viewer_stall,
            access: self.access,
            metrics: Arc::new(Metrics::of(&self.registry)),
            document: Arc::new(document),
            stored_pictures: Arc::new(Semaphore::new(1)),
            streams,
        };
        let registry = self.registry;
        let drain = Duration::from_secs_f64(self.config.drain_s);
        let (stopped, stopping) = tokio::sync::oneshot::channel();
        let stop = async move {
            shutdown.await;
            registry.start_draining();
            // The receiver is gone only where the server failed before.
            let _ = stopped.send(());
        };
        let serving = axum::serve(self.listener, router(api, app)).with_graceful_shutdown(stop).into_future();
        let deadline = async {
            if stopping.await.is_ok() {
                tokio::time::sleep(drain).await;
            } else {
                std::future::pending::<()>().await;
            }
        };
        let drained = async {
            serving.await?;
            // Nothing is ever sent; this ends when the last stream drops its sender.
            let _ = open_streams.recv().await;
            Ok(())
        };
        tokio::select! {
            result = drained => result,
            () = deadline => {
                tracing::warn!("some connections did not end in time");
                Ok(())
            }
        }
    }
}

/// What is served, described where it is listed.
fn documented() -> (Router<App>, Value) {
    use StatusCode as Status;
    const UNKNOWN: &[StatusCode] = &[StatusCode::NOT_FOUND];
    let api = Api::new()
        .route(
            routes::HEALTH,
            [get(api::health, "Whether the server takes work").refuses(&[Status::SERVICE_UNAVAILABLE])],
        )
        .route(
            routes::SESSIONS,
            [
                get(api::list, "All open sessions").answers::<Vec<api::SessionJson>>(Status::OK),
                post(api::open, "Opens a session: with the cameras of a cart, or with a recording to replay")
                    .takes::<api::OpenRequest>()
                    .answers::<api::OpenedJson>(Status::CREATED)
                    .refuses(api::OPEN_REFUSALS),
            ],
        )
        .route(
            routes::SESSION,
            [
                get(api::inspect, "One open session")
                    .answers::<api::SessionJson>(Status::OK)
                    .refuses(UNKNOWN),
                delete(api::close, "Closes a session; its results are then among the finished ones")
                    .answers_with(Status::NO_CONTENT)
                    .refuses(UNKNOWN),
            ],
        )
        .route(
            routes::MODEL,
            [get(downloads::model, "The model as it is now, PLY").refuses(downloads::MODEL_REFUSALS)],
        )
        .route(
            routes::TRAJECTORY,
            [get(downloads::trajectory, "The poses published so far, TUM").refuses(UNKNOWN)],
        )
        .route(
            routes::REPLAY,
            [post(replay::change, "Pauses, seeks, sets the rate of a replay")
                .takes::<replay::ReplayRequest>()
                .answers::<api::SessionJson>(Status::OK)
                .refuses(&[Status::NOT_FOUND, Status::CONFLICT])],
        )
        .route(
            routes::INGEST,
            [get(upgrade::ingest, "WebSocket of a cart: pairs in; poses, state, refusals out")
                .answers_with(Status::SWITCHING_PROTOCOLS)
                .refuses(&[Status::NOT_FOUND, Status::CONFLICT])],
        )
        .route(
            routes::VIEW,
            [get(upgrade::view, "WebSocket of a viewer: all lanes out")
                .answers_with(Status::SWITCHING_PROTOCOLS)
                .refuses(UNKNOWN)],
        )
        .route(
            routes::PICTURE,
            [get(picture::of_session, "A picture of the model from any pose, PNG")
                .asks::<picture::PictureQuery>()
                .refuses(picture::REFUSALS)],
        );
    documented_files(api).finish()
}

/// What is on the disk, and what the server says about itself.
fn documented_files(api: Api) -> Api {
    use StatusCode as Status;
    const UNKNOWN: &[StatusCode] = &[StatusCode::NOT_FOUND];
    api.route(
        routes::FINISHED,
        [get(finished::list, "What finished sessions left behind, newest first")
            .answers::<Vec<FinishedRun>>(Status::OK)],
    )
    .route(
        routes::FINISHED_RUN,
        [
            get(finished::inspect, "What one of them left behind")
                .answers::<FinishedRun>(Status::OK)
                .refuses(UNKNOWN),
            delete(finished::remove, "Removes it").answers_with(Status::NO_CONTENT).refuses(UNKNOWN),
        ],
    )
    .route(
        routes::FINISHED_PICTURE,
        [get(picture::of_finished, "A picture of the model that it left, from any pose, PNG")
            .asks::<picture::PictureQuery>()
            .refuses(picture::REFUSALS)],
    )
    .route(
        routes::FINISHED_FILE,
        [get(finished::file, "model.ply, model.png, trajectory.tum, report.json or recording.mcap")
            .refuses(UNKNOWN)],
    )
    .route(
        routes::RECORDINGS,
        [get(recordings::list, "Recordings that can be replayed")
            .answers::<Vec<StoredRecording>>(Status::OK)],
    )
    .route(
        routes::RECORDING,
        [
            get(recordings::download, "A recording").refuses(UNKNOWN),
            put(recordings::upload, "Uploads a recording (MCAP), which is checked before it is kept")
                .answers::<StoredRecording>(Status::CREATED)
                .refuses(recordings::UPLOAD_REFUSALS),
            delete(recordings::remove, "Removes a recording")
                .answers_with(Status::NO_CONTENT)
                .refuses(UNKNOWN),
        ],
    )
    .route(routes::METRICS, [get(metrics::render, "Counts and rates for Prometheus")])
    .route(routes::OPENAPI, [get(describe, "This document")])
}

async fn describe(State(app): State<App>) -> Json<Value> {
    Json((*app.document).clone())
}

fn router(api: Router<App>, app: App) -> Router {
    api.fallback(axum::routing::get(page::serve))
        .layer(DefaultBodyLimit::max(BODY_MAX_BYTES))
        .layer(middleware::from_fn_with_state(app.clone(), access::identify))
        .layer(middleware::from_fn(security::refuse_foreign_pages))
        .layer(middleware::map_response(security::add_headers))
        .with_state(app)
}
