//! A viewer's connection to a session, over either transport.

mod websocket;
mod zenoh;

use protocol::v1::{Reason, from_server};
use protocol::{Bytes, Endpoint, SessionId};

/// A connection that was greeted; the model comes by itself.
pub enum Link {
    /// Over the server's HTTP port.
    WebSocket(Box<websocket::WebSocketLink>),
    /// Over zenoh.
    Zenoh(Box<zenoh::ZenohLink>),
}

/// Why there is no connection, or not any more.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// The server does not want it.
    #[error("{text}")]
    Refused {
        /// Its reason.
        reason: Reason,
        /// What it says.
        text: String,
    },
    /// The network, or what came over it.
    #[error("{0}")]
    Lost(String),
}

impl LinkError {
    fn lost(error: impl std::fmt::Display) -> Self {
        Self::Lost(error.to_string())
    }
}

impl Link {
    /// Connects; `token` is shown where the server wants one (WebSocket only).
    ///
    /// # Errors
    /// [`LinkError`].
    pub async fn connect(to: &Endpoint, session: &SessionId, token: Option<&str>) -> Result<Self, LinkError> {
        match to {
            Endpoint::WebSocket(authority) => {
                let link = websocket::WebSocketLink::connect(authority, session, token).await?;
                Ok(Self::WebSocket(Box::new(link)))
            }
            Endpoint::Zenoh(endpoint) => {
                Ok(Self::Zenoh(Box::new(zenoh::ZenohLink::connect(endpoint, session).await?)))
            }
        }
    }

    /// What the server says next. Nothing is lost when the future is dropped before it is ready.
    ///
    /// # Errors
    /// [`LinkError`].
    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        match self {
            Self::WebSocket(link) => link.receive().await,
            Self::Zenoh(link) => link.receive().await,
        }
    }

    /// Asks for the whole model again.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub async fn resync(&mut self, held_epoch: u32) -> Result<(), LinkError> {
        match self {
            Self::WebSocket(link) => link.resync(held_epoch).await,
            Self::Zenoh(link) => link.ask_for_snapshot().await,
        }
    }
}

/// A body, or why there is none.
fn read(bytes: Bytes) -> Result<Option<from_server::Body>, LinkError> {
    protocol::decode_from_server(bytes).map(|envelope| envelope.body).map_err(LinkError::lost)
}

/// The greeting that the server must answer with.
fn expect_hello(body: Option<from_server::Body>) -> Result<(), LinkError> {
    match body {
        Some(from_server::Body::Hello(hello)) => protocol::negotiate(&hello).map(drop).map_err(|error| {
            LinkError::Refused { reason: Reason::UnsupportedVersion, text: error.to_string() }
        }),
        Some(from_server::Body::Refusal(refusal)) => {
            Err(LinkError::Refused { reason: refusal.reason(), text: refusal.text })
        }
        _ => Err(LinkError::lost("the server answers with something else than a hello")),
    }
}

const SOFTWARE: &str = concat!("mis-slam-view ", env!("CARGO_PKG_VERSION"));
