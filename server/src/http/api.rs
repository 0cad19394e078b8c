//! Sessions over HTTP: opened, listed, inspected, closed.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use protocol::v1::{Calibration, Reason, ReplayPosition, SessionState};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::App;
use super::access::{Caller, Scope};
use super::error::off_runtime;
use super::replay::checked_rate;
use crate::session::intake::Rejection;
use crate::session::lifecycle::Closing;
use crate::session::live::Session;
use crate::session::registry::{FeedWanted, Opening};

/// Opens a session: with the cameras of a cart, or with a recording to replay.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct OpenRequest {
    /// 1 to 64 characters of `A-Z a-z 0-9 _ -`; the server makes one where there is none.
    session: Option<String>,
    /// The cart's cameras.
    calibration: Option<Calibration>,
    /// A recording in the place of a cart.
    replay: Option<ReplayWanted>,
    /// Keeps what comes and what is found as a recording.
    #[serde(default)]
    record: bool,
}

/// A stored recording to be replayed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReplayWanted {
    /// Its name.
    recording: String,
    /// Times the recorded pace, 1 where it is left out; 0: as fast as pairs are taken.
    rate: Option<f64>,
    /// Waits before the first pair.
    #[serde(default)]
    paused: bool,
}

/// Where a replay is.
#[derive(Debug, Serialize, JsonSchema)]
struct ReplayJson {
    recording: String,
    position_s: f64,
    duration_s: f64,
    paused: bool,
    rate: f64,
    ended: bool,
}

impl From<ReplayPosition> for ReplayJson {
    fn from(at: ReplayPosition) -> Self {
        Self {
            recording: at.recording,
            position_s: at.position_ns as f64 / 1e9,
            duration_s: at.duration_ns as f64 / 1e9,
            paused: at.paused,
            rate: at.rate,
            ended: at.ended,
        }
    }
}

/// A session's state in JSON; the names and units are those of the `SessionState` message.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct SessionJson {
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
    model_stale: bool,
    recording: bool,
    alarms: Vec<String>,
    replay: Option<ReplayJson>,
    span_s: f64,
    reconstruction: u32,
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
            model_stale: state.model_stale,
            recording: state.recording,
            alarms: state.alarms,
            replay: state.replay.map(ReplayJson::from),
            span_s: state.span_ns as f64 / 1e9,
            reconstruction: state.reconstruction,
        }
    }
}

/// What only whoever opens a session is told.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct OpenedJson {
    #[serde(flatten)]
    state: SessionJson,
    /// With it a cart may take the session over from another one.
    takeover_token: String,
}

/// Why no session may be opened, besides its token.
pub(super) const OPEN_REFUSALS: &[StatusCode] = &[
    StatusCode::BAD_REQUEST,
    StatusCode::NOT_FOUND,
    StatusCode::CONFLICT,
    StatusCode::UNPROCESSABLE_ENTITY,
    StatusCode::TOO_MANY_REQUESTS,
    StatusCode::SERVICE_UNAVAILABLE,
];

/// Whether the server takes work.
pub(super) async fn health(State(app): State<App>) -> Response {
    let (status, text) = if app.registry.is_draining() {
        (StatusCode::SERVICE_UNAVAILABLE, "draining")
    } else {
        (StatusCode::OK, "ok")
    };
    (status, Json(serde_json::json!({"status": text, "version": env!("CARGO_PKG_VERSION")}))).into_response()
}

/// All open sessions.
pub(super) async fn list(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
) -> Result<Json<Vec<SessionJson>>, Rejection> {
    caller.require(Scope::View)?;
    let sessions = app.registry.list().into_iter();
    let known = sessions.filter(|session| caller.knows(session.hub().id().as_str()));
    Ok(Json(known.map(|session| session.hub().snapshot_state().into()).collect()))
}

/// One open session.
pub(super) async fn inspect(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Json<SessionJson>, Rejection> {
    Ok(Json(session(&app, &caller, Scope::View, &id)?.hub().snapshot_state().into()))
}

/// An open session that the caller may use for this.
pub(super) fn session(app: &App, caller: &Caller, scope: Scope, id: &str) -> Result<Arc<Session>, Rejection> {
    caller.require_for(Scope::View, id)?;
    let session = app.registry.find(id)?;
    caller.require(scope)?;
    Ok(session)
}

/// Opens a session. Building a reconstruction blocks, so it happens off the async runtime.
pub(super) async fn open(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    body: Result<Json<OpenRequest>, JsonRejection>,
) -> Result<(StatusCode, Json<OpenedJson>), Rejection> {
    let Json(request) = body.map_err(|error| body_rejection(&error))?;
    let opening = opening(request)?;
    // A token for one session can only open that one.
    caller.require_for(Scope::Feed, opening.id.as_ref().map_or("", |id| id.as_str())).map_err(
        |rejection| match rejection.reason {
            Reason::Forbidden => rejection,
            _ => Rejection::new(Reason::Forbidden, "the token is for another session"),
        },
    )?;
    let opened = off_runtime(move || app.registry.open(&opening)).await??;
    let takeover_token = opened.hub().takeover_token().to_owned();
    let state = SessionJson::from(opened.hub().snapshot_state());
    Ok((StatusCode::CREATED, Json(OpenedJson { state, takeover_token })))
}

fn opening(request: OpenRequest) -> Result<Opening, Rejection> {
    let id = request
        .session
        .map(|id| id.parse())
        .transpose()
        .map_err(|error| Rejection::new(Reason::InvalidSessionId, format!("{error}")))?;
    let feed = match (request.calibration, request.replay) {
        (Some(calibration), None) => FeedWanted::Cart(Box::new(calibration)),
        (None, Some(ReplayWanted { recording, rate, paused })) => {
            FeedWanted::Replay { recording, rate: checked_rate(rate.unwrap_or(1.0))?, paused }
        }
        _ => {
            let text = "exactly one of calibration and replay is needed";
            return Err(Rejection::new(Reason::MalformedMessage, text));
        }
    };
    Ok(Opening { id, record: request.record, feed })
}

/// Closes a session; its results are then among the finished ones.
pub(super) async fn close(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<StatusCode, Rejection> {
    let session = session(&app, &caller, Scope::Feed, &id)?;
    let registry = Arc::clone(&app.registry);
    off_runtime(move || registry.close(&session, Closing::by_request())).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Why a body is none.
pub(super) fn body_rejection(error: &JsonRejection) -> Rejection {
    let reason = match error.status() {
        StatusCode::PAYLOAD_TOO_LARGE => Reason::OversizedMessage,
        _ => Reason::MalformedMessage,
    };
    Rejection::new(reason, error.body_text())
}
