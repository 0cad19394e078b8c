//! One WebSocket that carries envelopes.

use futures_util::{SinkExt, StreamExt};
use protocol::v1::{Reason, from_server, to_server};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::handshake::client::Request;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

use crate::{LinkError, expect_hello, read};

/// A WebSocket to a server.
#[derive(Debug)]
pub struct Socket(WebSocketStream<MaybeTlsStream<TcpStream>>);

impl Socket {
    /// Connects without Nagle's delay: a message leaves when it is there.
    ///
    /// # Errors
    /// [`LinkError::Refused`] where the upgrade is refused with a reason, else [`LinkError::Lost`].
    pub async fn connect(request: Request, sizes: WebSocketConfig) -> Result<Self, LinkError> {
        let (socket, _) = connect_async_with_config(request, Some(sizes), true).await.map_err(refused)?;
        Ok(Self(socket))
    }

    /// Says hello as `software` and waits for the answer; gives the takeover token in it.
    ///
    /// # Errors
    /// As [`expect_hello`].
    pub async fn greet(&mut self, software: &str) -> Result<String, LinkError> {
        self.put(to_server::Body::Hello(protocol::hello(software))).await?;
        expect_hello(Some(self.receive().await?))
    }

    /// Sends a message.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub async fn put(&mut self, body: to_server::Body) -> Result<(), LinkError> {
        let bytes = protocol::to_server(body, None);
        self.0.send(Message::Binary(bytes)).await.map_err(LinkError::lost)
    }

    /// What the server says next. Nothing is lost when the future is dropped before it is ready.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        loop {
            match self.0.next().await {
                Some(Ok(Message::Binary(bytes))) => {
                    if let Some(body) = read(bytes)? {
                        return Ok(body);
                    }
                }
                Some(Ok(Message::Close(frame))) => {
                    let reason = frame.map(|frame| frame.reason.to_string()).unwrap_or_default();
                    return Err(LinkError::Lost(format!("the server closed the connection: {reason}")));
                }
                Some(Ok(_)) => {}
                Some(Err(error)) => return Err(LinkError::lost(error)),
                None => return Err(LinkError::lost("the connection ended")),
            }
        }
    }

    /// Says goodbye, so that the server knows at once.
    pub async fn close(mut self) {
        // The server may be gone already.
        let _ = self.0.close(None).await;
    }
}

/// The upgrade tells by its status and body why it is refused.
fn refused(error: Error) -> LinkError {
    let Error::Http(response) = error else { return LinkError::lost(error) };
    let status = response.status().as_u16();
    refusal(status, &response.into_body().unwrap_or_default())
}

/// Why the server's HTTP side refuses.
pub fn refusal(status: u16, body: &[u8]) -> LinkError {
    let told: serde_json::Value = serde_json::from_slice(body).unwrap_or_default();
    let text = told["text"].as_str().map_or_else(|| format!("HTTP status {status}"), str::to_owned);
    let named = |reason: &Reason| told["reason"] == reason.name();
    match (1..).map_while(|code| Reason::try_from(code).ok()).find(named) {
        Some(reason) => LinkError::Refused { reason, text },
        None => LinkError::Lost(text),
    }
}
