//! From an HTTP request to a WebSocket, or to a status that says why not.

use std::sync::Arc;

use axum::Extension;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use protocol::routes;
use protocol::v1::Reason;

use super::App;
use super::access::{Caller, Scope};
use super::api::session;
use super::socket::{Limits, Peer};
use crate::ingest;
use crate::publish;
use crate::session::intake::Rejection;
use crate::session::live::Session;

/// A viewer sends nothing longer than a hello.
const VIEWER_MESSAGE_MAX_BYTES: usize = 4 << 10;

/// WebSocket of a cart: pairs in; poses, state and refusals out.
pub(super) async fn ingest(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Rejection> {
    let session = open_session(&app, &caller, Scope::Feed, &id)?;
    let presented = headers.get(routes::TAKEOVER_HEADER).and_then(|token| token.to_str().ok());
    let feed = ingest::socket::Feed::claim(session, presented.unwrap_or_default())?;
    let limits = Limits { message_max_bytes: app.message_max_bytes, stall: app.viewer_stall };
    let registry = Arc::clone(&app.registry);
    Ok(limited(upgrade, limits.message_max_bytes).on_upgrade(async move |socket| {
        let _open = app.streams;
        ingest::socket::serve(Peer::new(socket, limits, caller), feed, registry).await;
    }))
}

/// WebSocket of a viewer: all lanes out.
pub(super) async fn view(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Rejection> {
    let hub = Arc::clone(open_session(&app, &caller, Scope::View, &id)?.hub());
    let limits = Limits { message_max_bytes: VIEWER_MESSAGE_MAX_BYTES, stall: app.viewer_stall };
    Ok(limited(upgrade, limits.message_max_bytes).on_upgrade(async move |socket| {
        let _open = app.streams;
        publish::viewer::serve(Peer::new(socket, limits, caller), hub).await;
    }))
}

fn open_session(app: &App, caller: &Caller, scope: Scope, id: &str) -> Result<Arc<Session>, Rejection> {
    if app.registry.is_draining() {
        return Err(Rejection::new(Reason::ShuttingDown, "the server is shutting down"));
    }
    session(app, caller, scope, id)
}

/// Sizes are checked by the frame header, before anything is allocated. Messages out are awaited one by one, so no
/// more than one is ever buffered.
fn limited(upgrade: WebSocketUpgrade, limit: usize) -> WebSocketUpgrade {
    upgrade.max_message_size(limit).max_frame_size(limit).write_buffer_size(0)
}
