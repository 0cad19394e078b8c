//! The whole server: sessions, HTTP, zenoh; bound, run, drained.

use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use serde::Deserialize;
use tokio::task::JoinHandle;
use tokio::time::MissedTickBehavior;

use crate::config::Config;
use crate::http::access::{Access, AccessConfig, AccessError};
use crate::http::{HttpServer, ServerConfig};
use crate::ingest::{self, ZenohConfig};
use crate::publish::zenoh::ZenohError;
use crate::publish::{self, PublishConfig};
use crate::session::SessionConfig;
use crate::session::engine::Engine;
use crate::session::lifecycle::Closing;
use crate::session::registry::{Registry, RegistryConfig};
use crate::storage::{Storage, StorageConfig, StorageError};

/// The sections of the configuration that concern the network.
#[derive(Clone, Debug, Deserialize)]
pub struct ServiceConfig {
    /// HTTP.
    pub server: ServerConfig,
    /// Sessions.
    pub session: SessionConfig,
    /// zenoh.
    pub zenoh: ZenohConfig,
    /// Lanes.
    pub publish: PublishConfig,
    /// Which calibrations are believed.
    pub rig: geometry::validate::RigLimits,
    /// Format and topics of recordings.
    pub recording: recording::RecordingConfig,
    /// What is kept on the disk.
    pub storage: StorageConfig,
    /// Who may do what.
    pub access: AccessConfig,
}

impl From<&Config> for ServiceConfig {
    fn from(config: &Config) -> Self {
        Self {
            server: config.server.clone(),
            session: config.session.clone(),
            zenoh: config.zenoh.clone(),
            publish: config.publish.clone(),
            rig: config.rig,
            recording: config.recording.clone(),
            storage: config.storage.clone(),
            access: config.access.clone(),
        }
    }
}

/// Why the server does not run.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The address cannot be had.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The HTTP server failed.
    #[error("HTTP: {0}")]
    Http(#[from] std::io::Error),
    /// The directory cannot be used.
    #[error("storage: {0}")]
    Storage(#[from] StorageError),
    /// Tokens cannot be checked.
    #[error("access: {0}")]
    Access(#[from] AccessError),
    /// zenoh refused its endpoints.
    #[error(transparent)]
    Zenoh(#[from] ZenohError),
}

/// A server that is bound and not yet running.
pub struct Service {
    http: HttpServer,
    zenoh: Option<zenoh::Session>,
    registry: Arc<Registry>,
    config: ServiceConfig,
}

impl Service {
    /// Binds HTTP and zenoh; sessions compute with `engine`.
    ///
    /// # Errors
    /// [`ServiceError`] where an address cannot be had.
    pub async fn bind(config: &ServiceConfig, engine: Arc<dyn Engine>) -> Result<Self, ServiceError> {
        let access = Access::load(&config.access, config.zenoh.enabled)?;
        let registry_config = RegistryConfig {
            session: config.session.clone(),
            publish: config.publish.clone(),
            rig: config.rig,
            recording: config.recording.clone(),
        };
        let storage = Storage::open(&config.storage)?.map(Arc::new);
        let registry = Arc::new(Registry::new(registry_config, engine, storage));
        let stall = Duration::from_secs_f64(config.publish.viewer_stall_s);
        let http = HttpServer::bind(&config.server, Arc::clone(&registry), (access, stall))
            .await
            .map_err(|source| ServiceError::Listen { address: config.server.listen, source })?;
        let zenoh = if config.zenoh.enabled {
            Some(ingest::zenoh::open(&config.zenoh, config.server.message_max_bytes()).await?)
        } else {
            None
        };
        let recovering = Arc::clone(&registry);
        if tokio::task::spawn_blocking(move || recovering.recover()).await.is_err() {
            tracing::error!("the recovery after a crash panicked");
        }
        Ok(Self { http, zenoh, registry, config: config.clone() })
    }

    /// The HTTP address, its port filled in.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> Result<SocketAddr, ServiceError> {
        Ok(self.http.address()?)
    }

    /// The zenoh endpoints that are listened on, ports filled in.
    pub async fn zenoh_endpoints(&self) -> Vec<String> {
        match &self.zenoh {
            Some(zenoh) => zenoh.info().locators().await.iter().map(ToString::to_string).collect(),
            None => Vec::new(),
        }
    }

    /// The sessions.
    pub fn registry(&self) -> &Arc<Registry> {
        &self.registry
    }

    /// Serves until `shutdown`; then refuses new work, tells everybody, ends all sessions.
    ///
    /// # Errors
    /// [`ServiceError`].
    pub async fn run(self, shutdown: impl Future<Output = ()> + Send + 'static) -> Result<(), ServiceError> {
        let ticking = tokio::spawn(tick(Arc::clone(&self.registry), self.config.publish.state_hz));
        let message_max_bytes = self.config.server.message_max_bytes();
        let on_zenoh = self.zenoh.as_ref().map(|zenoh| serve_zenoh(zenoh, &self.registry, message_max_bytes));
        let served = self.http.run(shutdown).await;
        let registry = self.registry;
        let drain = Duration::from_secs_f64(self.config.server.drain_s);
        let drained = tokio::task::spawn_blocking(move || registry.drain());
        if tokio::time::timeout(drain, drained).await.is_err() {
            tracing::warn!("some reconstructions did not end in time");
        }
        ticking.abort();
        on_zenoh.into_iter().flatten().for_each(|task| task.abort());
        if let Some(zenoh) = self.zenoh {
            zenoh.close().await.map_err(ZenohError::from)?;
        }
        Ok(served?)
    }
}

fn serve_zenoh(
    zenoh: &zenoh::Session,
    registry: &Arc<Registry>,
    message_max_bytes: usize,
) -> [JoinHandle<()>; 2] {
    let (session, sessions) = (zenoh.clone(), Arc::clone(registry));
    let carts = tokio::spawn(async move {
        if let Err(error) = ingest::zenoh::serve(session, sessions, message_max_bytes).await {
            tracing::error!(%error, "no carts over zenoh");
        }
    });
    [carts, tokio::spawn(publish::zenoh::serve(zenoh.clone(), Arc::clone(registry)))]
}

/// Lets time pass for all sessions, and takes away those that have ended.
async fn tick(registry: Arc<Registry>, rate_hz: f64) {
    let period = Duration::try_from_secs_f64(rate_hz.recip()).unwrap_or(Duration::MAX);
    let mut ticks = tokio::time::interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        for ended in registry.tick() {
            let registry = Arc::clone(&registry);
            // Nobody waits for it: the reconstruction ends while others go on.
            drop(tokio::task::spawn_blocking(move || {
                registry.close(&ended, Closing::because("the session has ended"));
            }));
        }
    }
}
