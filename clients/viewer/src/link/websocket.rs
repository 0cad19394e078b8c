//! All lanes of a session on one WebSocket.

use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use protocol::v1::{Reason, Resync, from_server, to_server};
use protocol::{SessionId, limits, routes};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

use super::{LinkError, SOFTWARE, expect_hello, read};

/// Time for the connection to come up.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

pub struct WebSocketLink {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
}

impl WebSocketLink {
    pub async fn connect(
        authority: &str,
        session: &SessionId,
        token: Option<&str>,
    ) -> Result<Self, LinkError> {
        let url = format!("ws://{authority}{}", routes::of_session(routes::VIEW, session));
        let mut request = url.into_client_request().map_err(LinkError::lost)?;
        if let Some(token) = token {
            let value = format!("Bearer {token}").parse().map_err(LinkError::lost)?;
            request.headers_mut().insert(AUTHORIZATION, value);
        }
        let sizes = WebSocketConfig::default()
            .max_message_size(Some(limits::MAX_MESSAGE_BYTES))
            .max_frame_size(Some(limits::MAX_MESSAGE_BYTES));
        let connecting = connect_async_with_config(request, Some(sizes), true);
        let (socket, _) = tokio::time::timeout(CONNECT_TIMEOUT, connecting)
            .await
            .map_err(|_| LinkError::lost("the server does not answer"))?
            .map_err(refused)?;
        let mut link = Self { socket };
        link.put(to_server::Body::Hello(protocol::hello(SOFTWARE))).await?;
        expect_hello(Some(link.receive().await?))?;
        Ok(link)
    }

    pub async fn resync(&mut self, held_epoch: u32) -> Result<(), LinkError> {
        self.put(to_server::Body::Resync(Resync { held_epoch })).await
    }

    async fn put(&mut self, body: to_server::Body) -> Result<(), LinkError> {
        let bytes = protocol::to_server(body, None);
        self.socket.send(Message::Binary(bytes)).await.map_err(LinkError::lost)
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        loop {
            match self.socket.next().await {
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
}

/// The upgrade tells by its status and body why it is refused.
fn refused(error: Error) -> LinkError {
    let Error::Http(response) = error else { return LinkError::lost(error) };
    let status = response.status().as_u16();
    let told: serde_json::Value =
        serde_json::from_slice(&response.into_body().unwrap_or_default()).unwrap_or_default();
    let text = told["text"].as_str().map_or_else(|| format!("HTTP status {status}"), str::to_owned);
    let named = |reason: &Reason| told["reason"] == reason.name();
    match (1..).map_while(|code| Reason::try_from(code).ok()).find(named) {
        Some(reason) => LinkError::Refused { reason, text },
        None => LinkError::Lost(text),
    }
}
