//! Why the benchmark could not be run.

/// Any of its parts failed.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// The change set.
    #[error("change set: {0}")]
    Dense(#[from] dense::DenseError),
    /// The GPU.
    #[error("GPU: {0}")]
    Gpu(#[from] gpu::GpuError),
    /// The configuration.
    #[error(transparent)]
    Config(#[from] mis_slam::config::SettingsError),
    /// The server.
    #[error("server: {0}")]
    Service(#[from] mis_slam::service::ServiceError),
    /// A socket or a file.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The results could not be written.
    #[error("results: {0}")]
    Json(#[from] serde_json::Error),
    /// A viewer's connection.
    #[error("viewer: {0}")]
    WebSocket(#[from] Box<tokio_tungstenite::tungstenite::Error>),
    /// A viewer's replica.
    #[error("replica: {0}")]
    Replica(#[from] replica::ReplicaError),
    /// A message.
    #[error("protocol: {0}")]
    Protocol(#[from] protocol::ProtocolError),
    /// The server let a viewer go.
    #[error("the server closed a viewer's stream")]
    Closed,
    /// A task ended early.
    #[error("a task failed: {0}")]
    Task(#[from] tokio::task::JoinError),
}
