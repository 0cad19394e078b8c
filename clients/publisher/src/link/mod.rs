//! A connection to the server; both transports carry the same envelopes.

use connection::LinkError;
use protocol::SessionId;
use protocol::v1::{Calibration, StereoPair, from_server};

use crate::Endpoint;

mod websocket;
mod zenoh;

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

const SOFTWARE: &str = concat!("mis-slam-cart ", env!("CARGO_PKG_VERSION"));
