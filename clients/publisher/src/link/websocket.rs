//! HTTP to open the session, a WebSocket to feed it.

use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use protocol::v1::{Calibration, Reason, StereoPair, from_server, to_server};
use protocol::{Bytes, SessionId, routes};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

use super::{Joined, LinkError, Purpose, SOFTWARE, expect_hello, read};

/// Opening a session may build GPU pipelines first.
const OPEN_TIMEOUT: Duration = Duration::from_secs(60);
/// Poses, states and refusals are short.
const MESSAGE_MAX_BYTES: usize = 1 << 20;
const CONFLICT: u16 = 409;

pub struct WebSocketLink {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
}

impl WebSocketLink {
    pub async fn connect(authority: &str, purpose: &Purpose) -> Result<(Self, Joined), LinkError> {
        let session = open_session(authority, purpose).await?;
        let url = format!("ws://{authority}{}", routes::of_session(routes::INGEST, &session));
        let limits = WebSocketConfig::default()
            .max_message_size(Some(MESSAGE_MAX_BYTES))
            .max_frame_size(Some(MESSAGE_MAX_BYTES))
            .write_buffer_size(0);
        let mut request = url.into_client_request().map_err(LinkError::lost)?;
        if let Ok(token) = purpose.takeover_token.parse() {
            request.headers_mut().insert(routes::TAKEOVER_HEADER, token);
        }
        // No Nagle: a pair leaves when it is there.
        let (socket, _) = connect_async_with_config(request, Some(limits), true).await.map_err(refused)?;
        let mut link = Self { socket };
        link.put(to_server::Body::Hello(protocol::hello(SOFTWARE))).await?;
        let takeover_token = expect_hello(Some(link.receive().await?))?;
        link.put(to_server::Body::Calibration(purpose.calibration.clone())).await?;
        Ok((link, Joined { session, takeover_token }))
    }

    pub async fn send(&mut self, pair: StereoPair) -> Result<(), LinkError> {
        self.put(to_server::Body::Pair(pair)).await
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

    pub async fn close(mut self) {
        // The server may be gone already.
        let _ = self.socket.close(None).await;
    }
}

/// The upgrade tells by its status and body why it is refused.
fn refused(error: Error) -> LinkError {
    match error {
        Error::Http(response) => {
            let status = response.status().as_u16();
            refusal(status, &response.into_body().unwrap_or_default())
        }
        other => LinkError::lost(other),
    }
}

fn refusal(status: u16, body: &[u8]) -> LinkError {
    let told: serde_json::Value = serde_json::from_slice(body).unwrap_or_default();
    let text = told["text"].as_str().map_or_else(|| format!("HTTP status {status}"), str::to_owned);
    let named = |reason: &Reason| told["reason"] == reason.name();
    match (1..).map_while(|code| Reason::try_from(code).ok()).find(named) {
        Some(reason) => LinkError::Refused { reason, text },
        None => LinkError::Lost(text),
    }
}

async fn open_session(authority: &str, purpose: &Purpose) -> Result<SessionId, LinkError> {
    let url = format!("http://{authority}{}", routes::SESSIONS);
    let wanted = purpose.session.clone();
    let calibration = purpose.calibration.clone();
    tokio::task::spawn_blocking(move || post_session(&url, wanted, &calibration))
        .await
        .map_err(LinkError::lost)?
}

/// A session that is open already is joined.
fn post_session(
    url: &str,
    wanted: Option<SessionId>,
    calibration: &Calibration,
) -> Result<SessionId, LinkError> {
    let agent: ureq::Agent = ureq::Agent::config_builder()
        .timeout_global(Some(OPEN_TIMEOUT))
        .http_status_as_error(false)
        .build()
        .into();
    let request =
        serde_json::json!({"session": wanted.as_ref().map(SessionId::as_str), "calibration": calibration});
    let mut response = agent.post(url).send_json(request).map_err(LinkError::lost)?;
    let status = response.status();
    let body = Bytes::from(response.body_mut().read_to_vec().map_err(LinkError::lost)?);
    match wanted {
        Some(session) if status.as_u16() == CONFLICT => return Ok(session),
        _ if !status.is_success() => return Err(refusal(status.as_u16(), &body)),
        _ => {}
    }
    let opened: serde_json::Value = serde_json::from_slice(&body).map_err(LinkError::lost)?;
    opened["session"].as_str().unwrap_or_default().parse().map_err(LinkError::lost)
}
