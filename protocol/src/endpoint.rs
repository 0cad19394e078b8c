//! Where the server is.

use std::fmt;
use std::str::FromStr;

/// An address that is neither of the two kinds.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no server address; expected ws://HOST:PORT or zenoh/tcp/HOST:PORT")]
pub struct EndpointError(pub String);

/// A server's address as given on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// `ws://host:port`: the authority.
    WebSocket(String),
    /// `zenoh/tcp/host:port`: the zenoh endpoint.
    Zenoh(String),
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    /// # Errors
    /// [`EndpointError`].
    fn from_str(given: &str) -> Result<Self, EndpointError> {
        let web_socket = given.strip_prefix("ws://").map(|rest| rest.trim_end_matches('/'));
        let zenoh = given.strip_prefix("zenoh/");
        match (web_socket, zenoh) {
            (Some(authority), _) if !authority.is_empty() && !authority.contains('/') => {
                Ok(Self::WebSocket(authority.to_owned()))
            }
            (_, Some(endpoint)) if endpoint.contains('/') => Ok(Self::Zenoh(endpoint.to_owned())),
            _ => Err(EndpointError(given.to_owned())),
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WebSocket(authority) => write!(f, "ws://{authority}"),
            Self::Zenoh(endpoint) => write!(f, "zenoh/{endpoint}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_transports_are_told_by_their_prefix() {
        for text in ["ws://gpu-box:8088", "zenoh/tcp/10.0.0.3:7447"] {
            assert_eq!(text.parse::<Endpoint>().unwrap().to_string(), text);
        }
        assert_eq!("ws://a:1/".parse::<Endpoint>().unwrap(), Endpoint::WebSocket("a:1".into()));
    }

    #[test]
    fn anything_else_is_refused() {
        for text in ["", "http://a", "ws://", "ws://a/api", "zenoh/", "zenoh/tcp", "gpu-box:8088"] {
            assert!(text.parse::<Endpoint>().is_err(), "{text}");
        }
    }
}
