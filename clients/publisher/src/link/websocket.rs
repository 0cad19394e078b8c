//! HTTP to open the session, a WebSocket to feed it.

use std::time::Duration;

use connection::LinkError;
use connection::websocket::{Socket, refusal};
use protocol::v1::{Calibration, StereoPair, from_server, to_server};
use protocol::{Bytes, SessionId, routes};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;

use super::{Joined, Purpose, SOFTWARE};

/// Opening a session may build GPU pipelines first.
const OPEN_TIMEOUT: Duration = Duration::from_secs(60);
/// Poses, states and refusals are short.
const MESSAGE_MAX_BYTES: usize = 1 << 20;
const CONFLICT: u16 = 409;

pub struct WebSocketLink {
    socket: Socket,
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
        let mut socket = Socket::connect(request, limits).await?;
        let takeover_token = socket.greet(SOFTWARE).await?;
        socket.put(to_server::Body::Calibration(purpose.calibration.clone())).await?;
        Ok((Self { socket }, Joined { session, takeover_token }))
    }

    pub async fn send(&mut self, pair: StereoPair) -> Result<(), LinkError> {
        self.socket.put(to_server::Body::Pair(pair)).await
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        self.socket.receive().await
    }

    pub async fn close(self) {
        self.socket.close().await;
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
