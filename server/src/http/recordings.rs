//! Recordings that can be replayed: listed, downloaded, uploaded, removed.

use std::path::Path as FilePath;
use std::sync::Arc;

use axum::body::{Body, BodyDataStream};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::Response;
use axum::{Extension, Json};
use futures_util::StreamExt;
use protocol::v1::Reason;
use recording::RecordingConfig;
use tokio::io::AsyncWriteExt;

use super::App;
use super::access::{Caller, Scope};
use super::error::{internal, off_runtime};
use super::finished::{send, storage};
use crate::session::intake::Rejection;
use crate::session::replay_source::ReplaySource;
use crate::storage::{Storage, StoredRecording};

/// Why an upload is not kept, besides its token.
pub(super) const UPLOAD_REFUSALS: &[StatusCode] = &[
    StatusCode::BAD_REQUEST,
    StatusCode::PAYLOAD_TOO_LARGE,
    StatusCode::UNPROCESSABLE_ENTITY,
    StatusCode::INSUFFICIENT_STORAGE,
];

fn unknown(name: &str) -> Rejection {
    Rejection::new(Reason::UnknownRecording, format!("no recording {name}"))
}

/// Recordings belong to no session: a token for one session only covers none.
fn require(app: &App, caller: &Caller, scope: Scope, name: &str) -> Result<Arc<Storage>, Rejection> {
    if !caller.knows("") {
        return Err(unknown(name));
    }
    caller.require(scope)?;
    storage(app).ok_or_else(|| unknown(name))
}

/// Recordings that can be replayed, by name.
pub(super) async fn list(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
) -> Result<Json<Vec<StoredRecording>>, Rejection> {
    caller.require(Scope::View)?;
    let Some(storage) = storage(&app).filter(|_| caller.knows("")) else { return Ok(Json(Vec::new())) };
    Ok(Json(off_runtime(move || storage.recordings()).await?.map_err(internal)?))
}

/// A recording.
pub(super) async fn download(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
) -> Result<Response, Rejection> {
    let storage = require(&app, &caller, Scope::View, &name)?;
    let path = storage.recording(&name).ok_or_else(|| unknown(&name))?;
    send(&path, "application/octet-stream").await
}

/// Removes a recording.
pub(super) async fn remove(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
) -> Result<StatusCode, Rejection> {
    let storage = require(&app, &caller, Scope::Manage, &name)?;
    let wanted = name.clone();
    let removed = off_runtime(move || storage.remove_recording(&wanted)).await?.map_err(internal)?;
    if removed { Ok(StatusCode::NO_CONTENT) } else { Err(unknown(&name)) }
}

/// Uploads a recording (MCAP), which is checked before it is kept.
pub(super) async fn upload(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(name): Path<String>,
    headers: HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<StoredRecording>), Rejection> {
    let storage = require(&app, &caller, Scope::Manage, &name)?;
    let limit_bytes = storage.config().upload_max_mib << 20;
    let claimed = headers.get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse().ok());
    if claimed.is_some_and(|bytes: u64| bytes > limit_bytes) {
        return Err(oversized(limit_bytes));
    }
    let bad_name = || Rejection::new(Reason::MalformedMessage, format!("{name:?} is no name; use NAME.mcap"));
    let upload = storage.upload(&name).ok_or_else(bad_name)?;
    let bytes = receive(body.into_data_stream(), upload.part(), (&storage, limit_bytes)).await?;
    let (config, recording) = (app.registry.recording_config().clone(), name.clone());
    off_runtime(move || {
        check(upload.part(), &config)?;
        upload.keep().map_err(|error| disk(&error))
    })
    .await??;
    Ok((StatusCode::CREATED, Json(StoredRecording { recording, bytes })))
}

fn oversized(limit_bytes: u64) -> Rejection {
    let limit_mib = limit_bytes >> 20;
    Rejection::new(Reason::OversizedMessage, format!("a recording may have {limit_mib} MiB at most"))
}

fn disk(error: &std::io::Error) -> Rejection {
    let full = error.kind() == std::io::ErrorKind::StorageFull;
    Rejection::new(if full { Reason::StorageFull } else { Reason::Internal }, error.to_string())
}

/// Writes the body to a file as it comes; it never lies in memory as a whole.
async fn receive(
    mut body: BodyDataStream,
    part: &FilePath,
    (storage, limit_bytes): (&Storage, u64),
) -> Result<u64, Rejection> {
    let mut file = tokio::fs::File::create(part).await.map_err(|error| disk(&error))?;
    let mut bytes = 0;
    while let Some(piece) = body.next().await {
        let piece = piece.map_err(|error| Rejection::new(Reason::MalformedMessage, error.to_string()))?;
        bytes += piece.len() as u64;
        if bytes > limit_bytes {
            return Err(oversized(limit_bytes));
        }
        storage.check_room().map_err(|error| disk(&error))?;
        file.write_all(&piece).await.map_err(|error| disk(&error))?;
    }
    file.flush().await.map_err(|error| disk(&error))?;
    Ok(bytes)
}

/// Only what a session could replay is kept.
fn check(path: &FilePath, config: &RecordingConfig) -> Result<(), Rejection> {
    ReplaySource::open("upload", path, config).map(drop).map_err(|error| {
        let text = error.to_string();
        // Where the server keeps it is nobody's business.
        let told = text.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&text);
        Rejection::new(Reason::InvalidRecording, told)
    })
}
