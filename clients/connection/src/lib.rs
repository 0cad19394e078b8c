//! What every client's connection to a server shares: the two transports, the greeting, and why there is no connection.

pub mod websocket;
pub mod zenoh;

use protocol::Bytes;
use protocol::v1::{Reason, from_server};

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
    /// The session was closed on purpose.
    #[error("the session was closed: {0}")]
    Closed(String),
    /// The network, or what came over it; it may work later.
    #[error("{0}")]
    Lost(String),
}

impl LinkError {
    /// A problem of the network, or of what came over it.
    pub fn lost(problem: impl std::fmt::Display) -> Self {
        Self::Lost(problem.to_string())
    }
}

/// A message's body; `None` for one of a newer version.
///
/// # Errors
/// [`LinkError::Lost`] where it is no message.
pub fn read(bytes: Bytes) -> Result<Option<from_server::Body>, LinkError> {
    protocol::decode_from_server(bytes).map(|envelope| envelope.body).map_err(LinkError::lost)
}

/// The greeting that the server must answer with; gives the takeover token in it, which may be empty.
///
/// # Errors
/// [`LinkError::Refused`] where the server refuses or speaks no common version, [`LinkError::Lost`] for any other answer.
pub fn expect_hello(body: Option<from_server::Body>) -> Result<String, LinkError> {
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
