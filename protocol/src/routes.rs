//! HTTP routes. `{id}` stands for a session id.

use crate::SessionId;

/// `GET`: 200 while the server takes work, 503 while it drains.
pub const HEALTH: &str = "/api/health";
/// `GET`: all sessions. `POST`: opens one; the body is JSON `{"session": optional id, "calibration": {...}}`.
pub const SESSIONS: &str = "/api/sessions";
/// `GET`: one session's state. `DELETE`: closes it.
pub const SESSION: &str = "/api/sessions/{id}";
/// WebSocket: pairs in, poses and refusals out.
pub const INGEST: &str = "/api/sessions/{id}/ingest";
/// WebSocket: all lanes out.
pub const VIEW: &str = "/api/sessions/{id}/view";

/// `route` with the session filled in.
pub fn of_session(route: &str, session: &SessionId) -> String {
    route.replace("{id}", session.as_str())
}
