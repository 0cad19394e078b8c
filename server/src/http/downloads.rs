//! What an open session has made so far, as files.

use axum::Extension;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use recording::export::{self, PlySurfel};

use super::App;
use super::access::{Caller, Scope};
use super::api::session;
use super::error::{internal, off_runtime};
use super::picture::answered_in_time;
use crate::convert;
use crate::session::intake::Rejection;

/// Why there is no model, besides the token.
pub(super) const MODEL_REFUSALS: &[StatusCode] = &[StatusCode::NOT_FOUND, StatusCode::SERVICE_UNAVAILABLE];

/// The model as it is now.
pub(super) async fn model(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Response, Rejection> {
    let session = session(&app, &caller, Scope::View, &id)?;
    let surfels = answered_in_time(session.pictures()?.ask_for_surfels()?).await?;
    let bytes = off_runtime(move || {
        let surfels: Vec<PlySurfel> = surfels.iter().map(convert::ply_surfel).collect();
        let mut bytes = Vec::new();
        export::encode_ply(&mut bytes, &surfels).map(|()| bytes).map_err(internal)
    })
    .await??;
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response())
}

/// The poses published so far.
pub(super) async fn trajectory(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Response, Rejection> {
    let poses = session(&app, &caller, Scope::View, &id)?.hub().published_poses();
    let text = off_runtime(move || export::tum_text(&poses)).await?;
    Ok(([(header::CONTENT_TYPE, "text/plain")], text).into_response())
}
