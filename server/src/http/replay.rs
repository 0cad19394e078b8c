//! Pause, seek and rate of a replay.

use std::time::Duration;

use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, State};
use axum::{Extension, Json};
use protocol::v1::Reason;
use schemars::JsonSchema;
use serde::Deserialize;

use super::App;
use super::access::{Caller, Scope};
use super::api::{SessionJson, body_rejection, session};
use crate::session::intake::Rejection;
use crate::session::replay_source::ReplayChange;

/// Greatest rate that is paced; 0 is as fast as pairs are taken.
const RATE_MAX: f64 = 100.0;

/// A change; what is left out stays.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReplayRequest {
    /// Whether no more pairs are handed on.
    paused: Option<bool>,
    /// Time since the recording's first pair to go to; the model then starts anew.
    position_s: Option<f64>,
    /// Times the recorded pace; 0: as fast as pairs are taken.
    rate: Option<f64>,
}

/// A rate that a replay can run at.
///
/// # Errors
/// [`Rejection`] names the value.
pub(super) fn checked_rate(rate: f64) -> Result<f64, Rejection> {
    if (0.0..=RATE_MAX).contains(&rate) {
        return Ok(rate);
    }
    let text = format!("rate {rate} is not between 0 and {RATE_MAX}");
    Err(Rejection::new(Reason::MalformedMessage, text))
}

/// Pauses, seeks, sets the rate of a replay.
pub(super) async fn change(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    body: Result<Json<ReplayRequest>, JsonRejection>,
) -> Result<Json<SessionJson>, Rejection> {
    let session = session(&app, &caller, Scope::Feed, &id)?;
    let Json(request) = body.map_err(|error| body_rejection(&error))?;
    let unusable = |at: f64| Rejection::new(Reason::MalformedMessage, format!("position_s {at} is no time"));
    let position = request.position_s.map(|at| Duration::try_from_secs_f64(at).map_err(|_| unusable(at)));
    let rate = request.rate.map(checked_rate).transpose()?;
    let control = session
        .replay()
        .ok_or_else(|| Rejection::new(Reason::NotAReplay, format!("a cart feeds session {id}")))?;
    control.change(ReplayChange { paused: request.paused, position: position.transpose()?, rate });
    Ok(Json(session.hub().snapshot_state().into()))
}
