//! A cart on a WebSocket: pairs in; poses, state and refusals out. Reading never waits for the reconstruction.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use protocol::v1::{Calibration, Reason, from_server, to_server};
use tokio::sync::broadcast::{self, error::RecvError};

use crate::http::off_runtime;
use crate::http::socket::{Ending, Peer, newest, session_closed};
use crate::session::intake::Rejection;
use crate::session::lifecycle::{SourceBusy, SourceId};
use crate::session::live::Session;
use crate::session::registry::Registry;

static NEXT_CONNECTION: AtomicU64 = AtomicU64::new(1);

/// A connection's right to feed a session; gives it back when dropped.
pub struct Feed {
    session: Arc<Session>,
    source: SourceId,
}

impl Feed {
    /// Claims the session for a new connection, which may present the takeover token.
    ///
    /// # Errors
    /// [`SourceBusy`] while another cart feeds it.
    pub fn claim(session: Arc<Session>, presented: &str) -> Result<Self, SourceBusy> {
        let number = NEXT_CONNECTION.fetch_add(1, Ordering::Relaxed);
        let source = SourceId::WebSocket(number);
        session.hub().join(source.clone(), presented)?;
        Ok(Self { session, source })
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.session.hub().leave(&self.source);
    }
}

/// Serves a cart until it or the session ends.
pub async fn serve(mut peer: Peer, feed: Feed, registry: Arc<Registry>) {
    let ending = match peer.greet(feed.session.hub().takeover_token()).await {
        Ok(()) => converse(&mut peer, &feed, &registry).await,
        Err(ending) => Err(ending),
    };
    if let Err(ending) = ending {
        tracing::info!(session = %feed.session.hub().id(), ?ending, "cart disconnected");
        // The session knows at once; the peer is told meanwhile.
        drop(feed);
        peer.end(ending).await;
    }
}

async fn converse(peer: &mut Peer, feed: &Feed, registry: &Arc<Registry>) -> Result<(), Ending> {
    let hub = feed.session.hub();
    let mut closing = hub.closing.subscribe();
    let (mut pose, mut state) = (hub.pose.subscribe(), hub.state.subscribe());
    state.mark_changed();
    let mut refusals = hub.refusals.subscribe();
    loop {
        tokio::select! {
            biased;
            bytes = newest(&mut state) => {
                // A takeover publishes the state, so that the first cart is told at once.
                if !hub.is_fed_by(&feed.source) && hub.source().is_some() {
                    return Err(Ending::Refused(taken_over()));
                }
                peer.send(bytes).await?;
            }
            closed = session_closed(&mut closing, hub.id()) => return Err(Ending::SessionClosed(closed)),
            bytes = newest(&mut pose) => peer.send(bytes).await?,
            bytes = next_refusal(&mut refusals) => peer.send(bytes).await?,
            message = peer.receive() => handle(message?, peer, feed, registry).await?,
        }
    }
}

fn taken_over() -> Rejection {
    Rejection::new(Reason::TakenOver, "another cart feeds this session now")
}

/// A cart that reads too slowly misses refusals; they are counted in the state all the same.
async fn next_refusal(refusals: &mut broadcast::Receiver<protocol::Bytes>) -> protocol::Bytes {
    loop {
        match refusals.recv().await {
            Ok(bytes) => return bytes,
            Err(RecvError::Lagged(_)) => {}
            Err(RecvError::Closed) => std::future::pending().await,
        }
    }
}

async fn handle(
    body: Option<to_server::Body>,
    peer: &mut Peer,
    feed: &Feed,
    registry: &Arc<Registry>,
) -> Result<(), Ending> {
    let (sequence, outcome) = match body {
        Some(to_server::Body::Pair(pair)) => (Some(pair.sequence), feed.session.offer(&feed.source, pair)),
        Some(to_server::Body::Calibration(calibration)) => {
            (None, recalibrate(feed, registry, calibration).await)
        }
        Some(
            to_server::Body::Hello(_)
            | to_server::Body::Resync(_)
            | to_server::Body::View(_)
            | to_server::Body::SharedChange(_),
        ) => {
            let text = "hello, resync, view and shared changes may not come here";
            return Err(Ending::Refused(Rejection::new(Reason::MalformedMessage, text)));
        }
        None => (None, Ok(())),
    };
    let Err(rejection) = outcome else { return Ok(()) };
    if rejection.reason == Reason::TakenOver {
        return Err(Ending::Refused(rejection));
    }
    let refusal = protocol::refusal(rejection.reason, rejection.text, sequence);
    peer.send(protocol::from_server(from_server::Body::Refusal(refusal))).await
}

/// Building a reconstruction blocks, so it happens off the async runtime.
async fn recalibrate(
    feed: &Feed,
    registry: &Arc<Registry>,
    calibration: Calibration,
) -> Result<(), Rejection> {
    let (session, registry) = (Arc::clone(&feed.session), Arc::clone(registry));
    off_runtime(move || registry.recalibrate(&session, &calibration)).await?
}
