//! A viewer on a WebSocket: all lanes of a session out.

use std::sync::Arc;

use protocol::Bytes;
use protocol::v1::{Reason, to_server};
use tokio::sync::watch;

use super::model_lane::Seed;
use crate::convert;
use crate::http::socket::{Ending, Peer, newest, refusal, session_closed};
use crate::session::hub::Hub;
use crate::session::intake::Rejection;

/// Serves a viewer until it or the session ends.
pub async fn serve(mut peer: Peer, hub: Arc<Hub>) {
    let ending = match peer.greet("").await {
        Ok(()) => follow(&mut peer, &hub).await,
        Err(ending) => Err(ending),
    };
    if let Err(ending) = ending {
        tracing::debug!(session = %hub.id(), ?ending, "viewer disconnected");
        peer.end(ending).await;
    }
}

/// Small lanes go first, so that a large model does not delay poses by more than one message.
async fn follow(peer: &mut Peer, hub: &Hub) -> Result<(), Ending> {
    let mut closing = hub.closing.subscribe();
    let model = hub.model.subscribe(Seed::Snapshot);
    let (mut state, mut pose, mut preview, mut shared) =
        (hub.state.subscribe(), hub.pose.subscribe(), hub.preview.subscribe(), hub.shared.subscribe());
    let mut features = None;
    for lane in [&mut state, &mut pose, &mut preview, &mut shared] {
        lane.mark_changed();
    }
    loop {
        tokio::select! {
            biased;
            bytes = newest(&mut state) => peer.send(bytes).await?,
            closed = session_closed(&mut closing, hub.id()) => return Err(Ending::SessionClosed(closed)),
            message = peer.receive() => match message? {
                Some(to_server::Body::Resync(_)) => model.resync(),
                Some(to_server::Body::View(view)) => {
                    features = view.features.then(|| features.unwrap_or_else(|| hub.features.subscribe()));
                    model.set_wishes(convert::wishes_from_wire(&view));
                }
                Some(to_server::Body::SharedChange(change)) => {
                    if let Err(rejection) = hub.change_shared(change) {
                        peer.send(protocol::from_server(refusal(rejection.reason, &rejection.text))).await?;
                    }
                }
                Some(_) => return Err(misplaced()),
                None => {}
            },
            bytes = newest(&mut shared) => peer.send(bytes).await?,
            bytes = newest(&mut pose) => peer.send(bytes).await?,
            bytes = newest_if_wanted(&mut features) => peer.send(bytes).await?,
            bytes = newest(&mut preview) => peer.send(bytes).await?,
            Some(bytes) = model.next() => peer.send(bytes).await?,
        }
    }
}

/// As [`newest`]; never ready for a viewer that does not want this lane.
async fn newest_if_wanted(lane: &mut Option<watch::Receiver<Option<Bytes>>>) -> Bytes {
    match lane {
        Some(lane) => newest(lane).await,
        None => std::future::pending().await,
    }
}

fn misplaced() -> Ending {
    Ending::Refused(Rejection::new(
        Reason::MalformedMessage,
        "a viewer sends nothing but view, resync and shared changes",
    ))
}
