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

/// `GET`: a picture of the model from any pose (PNG).
pub const PICTURE: &str = "/api/sessions/{id}/view.png";
/// `GET`: the model as it is now (PLY).
pub const MODEL: &str = "/api/sessions/{id}/model.ply";
/// `GET`: the poses published so far (TUM).
pub const TRAJECTORY: &str = "/api/sessions/{id}/trajectory.tum";
/// `POST`: pauses, seeks, sets the rate of a replay.
pub const REPLAY: &str = "/api/sessions/{id}/replay";
/// `GET`: what finished sessions left behind.
pub const FINISHED: &str = "/api/finished";
/// `GET`: what one of them left behind. `DELETE`: removes it.
pub const FINISHED_RUN: &str = "/api/finished/{run}";
/// `GET`: a picture of its model from any pose (PNG).
pub const FINISHED_PICTURE: &str = "/api/finished/{run}/view.png";
/// `GET`: one of its files: `model.ply`, `trajectory.tum`, `report.json`, `recording.mcap`.
pub const FINISHED_FILE: &str = "/api/finished/{run}/{file}";
/// `GET`: recordings that can be replayed.
pub const RECORDINGS: &str = "/api/recordings";
/// `GET`, `PUT`, `DELETE`: one of them.
pub const RECORDING: &str = "/api/recordings/{recording}";
/// `GET`: counts and rates for Prometheus.
pub const METRICS: &str = "/metrics";
/// `GET`: these routes as an `OpenAPI` document.
pub const OPENAPI: &str = "/openapi.json";

/// The request header in which a cart presents a session's takeover token.
pub const TAKEOVER_HEADER: &str = "x-takeover-token";

/// All of them.
pub const ALL: [&str; 17] = [
    HEALTH,
    SESSIONS,
    SESSION,
    INGEST,
    VIEW,
    PICTURE,
    MODEL,
    TRAJECTORY,
    REPLAY,
    FINISHED,
    FINISHED_RUN,
    FINISHED_PICTURE,
    FINISHED_FILE,
    RECORDINGS,
    RECORDING,
    METRICS,
    OPENAPI,
];

/// `route` with the session filled in.
pub fn of_session(route: &str, session: &SessionId) -> String {
    route.replace("{id}", session.as_str())
}
