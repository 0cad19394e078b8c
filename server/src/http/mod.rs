//! The HTTP server: API, streams, the embedded page; bound, run, drained.

use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::middleware;
use axum::routing::get;
use protocol::routes;
use serde::Deserialize;
use tokio::net::TcpListener;
use tokio::sync::mpsc;

use crate::session::registry::Registry;

mod api;
pub mod page;
mod security;
pub mod socket;
mod upgrade;

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
    /// Held by every open WebSocket; the server waits for all of them at its end.
    streams: mpsc::Sender<()>,
}

/// A bound HTTP server.
pub struct HttpServer {
    listener: TcpListener,
    config: ServerConfig,
    registry: Arc<Registry>,
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
        viewer_stall: Duration,
    ) -> std::io::Result<Self> {
        let listener = TcpListener::bind(config.listen).await?;
        Ok(Self { listener, config: config.clone(), registry, viewer_stall })
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
        let app = App {
            registry: Arc::clone(&self.registry),
            message_max_bytes: self.config.message_max_bytes(),
            viewer_stall: self.viewer_stall,
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
        let serving = axum::serve(self.listener, router(app)).with_graceful_shutdown(stop).into_future();
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

fn router(app: App) -> Router {
    Router::new()
        .route(routes::HEALTH, get(api::health))
        .route(routes::SESSIONS, get(api::list).post(api::open))
        .route(routes::SESSION, get(api::inspect).delete(api::close))
        .route(routes::INGEST, get(upgrade::ingest))
        .route(routes::VIEW, get(upgrade::view))
        .fallback(get(page::serve))
        .layer(DefaultBodyLimit::max(BODY_MAX_BYTES))
        .layer(middleware::from_fn(security::refuse_foreign_pages))
        .layer(middleware::map_response(security::add_headers))
        .with_state(app)
}
