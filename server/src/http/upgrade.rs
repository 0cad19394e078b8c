//! From an HTTP request to a WebSocket, or to a status that says why not.

use std::sync::Arc;

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, State};
use axum::response::Response;
use protocol::v1::Reason;

use super::App;
use super::socket::Peer;
use crate::ingest;
use crate::publish;
use crate::session::intake::Rejection;
use crate::session::live::Session;

/// A viewer sends nothing longer than a hello.
const VIEWER_MESSAGE_MAX_BYTES: usize = 4 << 10;

pub(super) async fn ingest(
    State(app): State<App>,
    Path(id): Path<String>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Rejection> {
    let session = open_session(&app, &id)?;
    let feed = ingest::socket::Feed::claim(session)?;
    let (limit, stall, registry) = (app.message_max_bytes, app.viewer_stall, Arc::clone(&app.registry));
    Ok(limited(upgrade, limit).on_upgrade(async move |socket| {
        let _open = app.streams;
        ingest::socket::serve(Peer::new(socket, limit, stall), feed, registry).await;
    }))
}

pub(super) async fn view(
    State(app): State<App>,
    Path(id): Path<String>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Rejection> {
    let hub = Arc::clone(open_session(&app, &id)?.hub());
    let (limit, stall) = (VIEWER_MESSAGE_MAX_BYTES, app.viewer_stall);
    Ok(limited(upgrade, limit).on_upgrade(async move |socket| {
        let _open = app.streams;
        publish::viewer::serve(Peer::new(socket, limit, stall), hub).await;
    }))
}

fn open_session(app: &App, id: &str) -> Result<Arc<Session>, Rejection> {
    if app.registry.is_draining() {
        return Err(Rejection::new(Reason::ShuttingDown, "the server is shutting down"));
    }
    app.registry.find(id)
}

/// Sizes are checked by the frame header, before anything is allocated. Messages out are awaited one by one, so no
/// more than one is ever buffered.
fn limited(upgrade: WebSocketUpgrade, limit: usize) -> WebSocketUpgrade {
    upgrade.max_message_size(limit).max_frame_size(limit).write_buffer_size(0)
}
