//! The JSON API.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use protocol::SessionId;
use protocol::v1::{Calibration, Reason, SessionState};
use serde::{Deserialize, Serialize};

use super::App;
use crate::session::intake::Rejection;

/// Body of a request that opens a session.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpenRequest {
    session: Option<String>,
    calibration: Calibration,
}

/// A session's state in JSON; the names and units are those of the `SessionState` message.
#[derive(Debug, Serialize)]
pub struct SessionJson {
    session: String,
    status: String,
    text: String,
    source_present: bool,
    tracking: String,
    picture: String,
    pairs_received: u64,
    poses_published: u64,
    frames_fused: u64,
    drops: BTreeMap<String, u64>,
    received_hz: f32,
    pose_hz: f32,
    fused_hz: f32,
    pair_age_ms: Option<f32>,
    pose_age_ms: Option<f32>,
    model_age_ms: Option<f32>,
    epoch: u32,
    surfels: u32,
    viewers: u32,
}

impl From<SessionState> for SessionJson {
    fn from(state: SessionState) -> Self {
        Self {
            status: state.status().name(),
            tracking: state.tracking().name(),
            drops: state.drops.iter().map(|drop| (drop.reason().name(), drop.count)).collect(),
            session: state.session,
            text: state.text,
            source_present: state.source_present,
            picture: state.picture,
            pairs_received: state.pairs_received,
            poses_published: state.poses_published,
            frames_fused: state.frames_fused,
            received_hz: state.received_hz,
            pose_hz: state.pose_hz,
            fused_hz: state.fused_hz,
            pair_age_ms: state.pair_age_ms,
            pose_age_ms: state.pose_age_ms,
            model_age_ms: state.model_age_ms,
            epoch: state.epoch,
            surfels: state.surfels,
            viewers: state.viewers,
        }
    }
}

impl IntoResponse for Rejection {
    fn into_response(self) -> Response {
        let status = match self.reason {
            Reason::MalformedMessage | Reason::InvalidSessionId => StatusCode::BAD_REQUEST,
            Reason::UnknownSession => StatusCode::NOT_FOUND,
            Reason::SessionBusy => StatusCode::CONFLICT,
            Reason::OversizedMessage => StatusCode::PAYLOAD_TOO_LARGE,
            Reason::InvalidCalibration => StatusCode::UNPROCESSABLE_ENTITY,
            Reason::TooManySessions => StatusCode::TOO_MANY_REQUESTS,
            Reason::ShuttingDown => StatusCode::SERVICE_UNAVAILABLE,
            _ => StatusCode::INTERNAL_SERVER_ERROR,
        };
        let body = serde_json::json!({"reason": self.reason.name(), "text": self.text});
        (status, Json(body)).into_response()
    }
}

pub(super) async fn health(State(app): State<App>) -> Response {
    let (status, text) = if app.registry.is_draining() {
        (StatusCode::SERVICE_UNAVAILABLE, "draining")
    } else {
        (StatusCode::OK, "ok")
    };
    (status, Json(serde_json::json!({"status": text, "version": env!("CARGO_PKG_VERSION")}))).into_response()
}

pub(super) async fn list(State(app): State<App>) -> Json<Vec<SessionJson>> {
    Json(app.registry.list().iter().map(|session| session.hub().snapshot_state().into()).collect())
}

pub(super) async fn inspect(
    State(app): State<App>,
    Path(id): Path<String>,
) -> Result<Json<SessionJson>, Rejection> {
    Ok(Json(app.registry.find(&id)?.hub().snapshot_state().into()))
}

/// Building a reconstruction blocks, so it happens off the async runtime.
pub(super) async fn open(
    State(app): State<App>,
    body: Result<Json<OpenRequest>, JsonRejection>,
) -> Result<Response, Rejection> {
    let Json(request) = body.map_err(|error| body_rejection(&error))?;
    let wanted: Option<SessionId> = request
        .session
        .map(|id| id.parse())
        .transpose()
        .map_err(|error| Rejection::new(Reason::InvalidSessionId, format!("{error}")))?;
    let opened = off_runtime(move || app.registry.open(wanted, &request.calibration)).await??;
    let state = SessionJson::from(opened.hub().snapshot_state());
    Ok((StatusCode::CREATED, Json(state)).into_response())
}

pub(super) async fn close(State(app): State<App>, Path(id): Path<String>) -> Result<StatusCode, Rejection> {
    let session = app.registry.find(&id)?;
    let registry = Arc::clone(&app.registry);
    off_runtime(move || registry.close(&session, "closed by request")).await?;
    Ok(StatusCode::NO_CONTENT)
}

async fn off_runtime<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Rejection> {
    tokio::task::spawn_blocking(work)
        .await
        .map_err(|error| Rejection::new(Reason::Internal, error.to_string()))
}

fn body_rejection(error: &JsonRejection) -> Rejection {
    let reason = match error.status() {
        StatusCode::PAYLOAD_TOO_LARGE => Reason::OversizedMessage,
        _ => Reason::MalformedMessage,
    };
    Rejection::new(reason, error.body_text())
}
