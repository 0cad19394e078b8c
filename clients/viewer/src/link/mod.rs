//! A viewer's connection to a session, over either transport.

mod websocket;
mod zenoh;

use connection::LinkError;
use protocol::v1::from_server;
use protocol::{Endpoint, SessionId};

/// A connection that was greeted; the model comes by itself.
pub enum Link {
    /// Over the server's HTTP port.
    WebSocket(Box<websocket::WebSocketLink>),
    /// Over zenoh.
    Zenoh(Box<zenoh::ZenohLink>),
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

const SOFTWARE: &str = concat!("mis-slam-view ", env!("CARGO_PKG_VERSION"));
