//! What finished sessions left behind.

use std::path::PathBuf;
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use bytes::BytesMut;
use protocol::v1::Reason;
use tokio::fs::File;
use tokio::io::AsyncReadExt;

use super::App;
use super::access::{Caller, Scope};
use super::error::{internal, off_runtime};
use crate::session::intake::Rejection;
use crate::storage::{FinishedRun, MODEL_FILE, Storage};

/// What is read of a file at a time.
const PIECE_BYTES: usize = 64 << 10;

fn unknown(run: &str) -> Rejection {
    Rejection::new(Reason::UnknownSession, format!("no finished session {run}"))
}

/// What is kept; without a directory there is nothing to be found.
pub(super) fn storage(app: &App) -> Option<Arc<Storage>> {
    app.registry.storage().cloned()
}

fn find(app: &App, caller: &Caller, run: &str) -> Result<(Arc<Storage>, FinishedRun), Rejection> {
    let storage = storage(app).ok_or_else(|| unknown(run))?;
    let found = storage.finished_run(run).filter(|found| caller.knows(&found.session));
    Ok((storage, found.ok_or_else(|| unknown(run))?))
}

/// What finished sessions left behind, newest first.
pub(super) async fn list(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
) -> Result<Json<Vec<FinishedRun>>, Rejection> {
    caller.require(Scope::View)?;
    let Some(storage) = storage(&app) else { return Ok(Json(Vec::new())) };
    let mut runs = off_runtime(move || storage.finished()).await?.map_err(internal)?;
    runs.retain(|run| caller.knows(&run.session));
    Ok(Json(runs))
}

/// What one finished session left behind.
pub(super) async fn inspect(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(run): Path<String>,
) -> Result<Json<FinishedRun>, Rejection> {
    let (_, found) = find(&app, &caller, &run)?;
    caller.require(Scope::View)?;
    Ok(Json(found))
}

/// Removes what a finished session left behind.
pub(super) async fn remove(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(run): Path<String>,
) -> Result<StatusCode, Rejection> {
    let (storage, _) = find(&app, &caller, &run)?;
    caller.require(Scope::Manage)?;
    off_runtime(move || storage.remove_finished(&run)).await?.map_err(internal)?;
    Ok(StatusCode::NO_CONTENT)
}

/// A file of a finished session: model.ply, model.png, trajectory.tum, report.json, recording.mcap.
pub(super) async fn file(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path((run, file)): Path<(String, String)>,
) -> Result<Response, Rejection> {
    let (storage, _) = find(&app, &caller, &run)?;
    caller.require(Scope::View)?;
    let (path, media_type) =
        storage.finished_file(&run, &file).ok_or_else(|| unknown(&format!("{run}/{file}")))?;
    send(&path, media_type).await
}

/// Where the model of a finished session lies.
pub(super) fn model_file(app: &App, caller: &Caller, run: &str) -> Result<PathBuf, Rejection> {
    let (storage, _) = find(app, caller, run)?;
    caller.require(Scope::View)?;
    let found = storage.finished_file(run, MODEL_FILE);
    found.map(|(path, _)| path).ok_or_else(|| unknown(&format!("{run}/{MODEL_FILE}")))
}

/// A file, a piece at a time, so that a long recording never lies in memory.
pub(super) async fn send(path: &std::path::Path, media_type: &'static str) -> Result<Response, Rejection> {
    let file = File::open(path).await.map_err(internal)?;
    let bytes = file.metadata().await.map_err(internal)?.len();
    let pieces = futures_util::stream::try_unfold(file, async |mut file| {
        let mut piece = BytesMut::with_capacity(PIECE_BYTES);
        let read = file.read_buf(&mut piece).await?;
        Ok::<_, std::io::Error>((read > 0).then(|| (piece.freeze(), file)))
    });
    let headers =
        [(header::CONTENT_TYPE, media_type.to_owned()), (header::CONTENT_LENGTH, bytes.to_string())];
    Ok((headers, Body::from_stream(pieces)).into_response())
}
