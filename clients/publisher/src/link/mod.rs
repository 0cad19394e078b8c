//! A connection to the server; both transports carry the same envelopes.

use protocol::v1::{Calibration, Reason, StereoPair, from_server};
use protocol::{Bytes, SessionId};

use crate::Endpoint;

mod websocket;
mod zenoh;

/// Why there is no connection, or not any more.
#[derive(Debug)]
pub enum LinkError {
    /// It may work later.
    Lost(String),
    /// The server does not want it.
    Refused {
        /// Its reason.
        reason: Reason,
        /// What it says.
        text: String,
    },
}

impl LinkError {
    fn lost(problem: impl std::fmt::Display) -> Self {
        Self::Lost(problem.to_string())
    }
}

/// A connection on which the session takes pairs.
pub enum Link {
    /// Over WebSocket.
    WebSocket(Box<websocket::WebSocketLink>),
    /// Over zenoh.
    Zenoh(Box<zenoh::ZenohLink>),
}

/// What a connection is made for.
#[derive(Clone, Debug)]
pub struct Purpose {
    /// The session, where the user or an earlier connection named it.
    pub session: Option<SessionId>,
    /// The cameras.
    pub calibration: Calibration,
    /// Presented to take the session over from another cart, or from one's own broken connection; may be empty.
    pub takeover_token: String,
}

/// What a connection is told.
#[derive(Clone, Debug)]
pub struct Joined {
    /// The session that it feeds.
    pub session: SessionId,
    /// The session's takeover token.
    pub takeover_token: String,
}

impl Link {
    /// Connects, opens the session where it is not open, and brings the calibration.
    ///
    /// # Errors
    /// [`LinkError`].
    pub async fn connect(to: &Endpoint, purpose: &Purpose) -> Result<(Self, Joined), LinkError> {
        match to {
            Endpoint::WebSocket(authority) => {
                let (link, joined) = websocket::WebSocketLink::connect(authority, purpose).await?;
                Ok((Self::WebSocket(Box::new(link)), joined))
            }
            Endpoint::Zenoh(endpoint) => {
                let (link, joined) = zenoh::ZenohLink::connect(endpoint, purpose).await?;
                Ok((Self::Zenoh(Box::new(link)), joined))
            }
        }
    }

    /// Sends a pair; may wait for the network.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub async fn send(&mut self, pair: StereoPair) -> Result<(), LinkError> {
        match self {
            Self::WebSocket(link) => link.send(pair).await,
            Self::Zenoh(link) => link.send(pair).await,
        }
    }

    /// What the server says next. Nothing is lost when the future is dropped before it is ready.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        match self {
            Self::WebSocket(link) => link.receive().await,
            Self::Zenoh(link) => link.receive().await,
        }
    }

    /// Says goodbye, so that the server knows at once.
    pub async fn close(self) {
        match self {
            Self::WebSocket(link) => link.close().await,
            Self::Zenoh(link) => link.close().await,
        }
    }
}

/// A body, or why there is none.
fn read(bytes: Bytes) -> Result<Option<from_server::Body>, LinkError> {
    protocol::decode_from_server(bytes).map(|envelope| envelope.body).map_err(LinkError::lost)
}

/// The greeting that the server must answer with; gives the takeover token in it.
fn expect_hello(body: Option<from_server::Body>) -> Result<String, LinkError> {
    match body {
        Some(from_server::Body::Hello(hello)) => match protocol::negotiate(&hello) {
            Ok(_) => Ok(hello.takeover_token),
            Err(error) => {
                Err(LinkError::Refused { reason: Reason::UnsupportedVersion, text: error.to_string() })
            }
        },
        Some(from_server::Body::Refusal(refusal)) => {
            Err(LinkError::Refused { reason: refusal.reason(), text: refusal.text })
        }
        _ => Err(LinkError::lost("the server answers with something else than a hello")),
    }
}

const SOFTWARE: &str = concat!("mis-slam-cart ", env!("CARGO_PKG_VERSION"));
