//! All lanes of a session on one WebSocket.

use std::time::Duration;

use connection::LinkError;
use connection::websocket::Socket;
use protocol::v1::{Resync, from_server, to_server};
use protocol::{SessionId, limits, routes};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;

use super::SOFTWARE;

/// Time for the connection to come up.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

pub struct WebSocketLink {
    socket: Socket,
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
        let mut socket = tokio::time::timeout(CONNECT_TIMEOUT, Socket::connect(request, sizes))
            .await
            .map_err(|_| LinkError::lost("the server does not answer"))??;
        socket.greet(SOFTWARE).await?;
        Ok(Self { socket })
    }

    pub async fn resync(&mut self, held_epoch: u32) -> Result<(), LinkError> {
        self.socket.put(to_server::Body::Resync(Resync { held_epoch })).await
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        self.socket.receive().await
    }
}
