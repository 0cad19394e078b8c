//! The lanes of every session on zenoh keys.

use std::sync::Arc;

use protocol::keys::{self, Lane};
use protocol::{Bytes, SessionId};
use tokio::task::JoinHandle;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

use super::model_lane::Seed;
use crate::http::socket::{farewell, newest, session_closed};
use crate::session::hub::Hub;
use crate::session::lifecycle::{Closing, SourceId};
use crate::session::registry::Registry;

/// What zenoh refused.
#[derive(Debug, thiserror::Error)]
#[error("zenoh: {0}")]
pub struct ZenohError(#[from] zenoh::Error);

/// Publishes all sessions, as they open and close; never ends by itself.
pub async fn serve(zenoh: zenoh::Session, registry: Arc<Registry>) {
    let mut changes = registry.changes();
    let mut followed: Vec<(Arc<Hub>, JoinHandle<()>)> = Vec::new();
    loop {
        followed.retain(|(_, task)| !task.is_finished());
        for session in registry.list() {
            let hub = session.hub();
            if !followed.iter().any(|(other, _)| Arc::ptr_eq(hub, other)) {
                let task = tokio::spawn(publish_or_log(zenoh.clone(), Arc::clone(hub)));
                followed.push((Arc::clone(hub), task));
            }
        }
        // The registry outlives this task, so its changes do not end.
        if changes.changed().await.is_err() {
            return;
        }
    }
}

async fn publish_or_log(zenoh: zenoh::Session, hub: Arc<Hub>) {
    if let Err(error) = publish(&zenoh, &hub).await {
        tracing::error!(session = %hub.id(), %error, "the session is not published over zenoh any more");
    }
}

/// The publishers of one session.
struct Lanes<'a> {
    pose: Publisher<'a>,
    state: Publisher<'a>,
    preview: Publisher<'a>,
    shared: Publisher<'a>,
    model: Publisher<'a>,
}

impl<'a> Lanes<'a> {
    /// State must arrive; a pose or preview that would have to wait is outdated. An epoch that would have to wait for
    /// one slow subscriber would hold up all: that one finds the gap and asks for a snapshot.
    async fn declare(zenoh: &'a zenoh::Session, id: &SessionId) -> Result<Self, ZenohError> {
        let lane = |lane: Lane, congestion, priority| {
            zenoh.declare_publisher(lane.key(id)).congestion_control(congestion).priority(priority)
        };
        Ok(Self {
            pose: lane(Lane::Pose, CongestionControl::Drop, Priority::RealTime).express(true).await?,
            state: lane(Lane::State, CongestionControl::Block, Priority::DataHigh).await?,
            preview: lane(Lane::Preview, CongestionControl::Drop, Priority::DataLow).await?,
            shared: lane(Lane::Shared, CongestionControl::Block, Priority::Data).await?,
            model: lane(Lane::ModelEpoch, CongestionControl::Drop, Priority::Data).await?,
        })
    }
}

async fn publish(zenoh: &zenoh::Session, hub: &Hub) -> Result<(), ZenohError> {
    let _alive = zenoh.liveliness().declare_token(keys::server_token(hub.id())).await?;
    let lanes = Lanes::declare(zenoh, hub.id()).await?;
    let mut closing = hub.closing.subscribe();
    let (mut state, mut pose, mut preview, mut shared) =
        (hub.state.subscribe(), hub.pose.subscribe(), hub.preview.subscribe(), hub.shared.subscribe());
    let mut refusals = hub.refusals.subscribe();
    let model = hub.model.subscribe(Seed::Nothing);
    state.mark_changed();
    loop {
        tokio::select! {
            biased;
            bytes = newest(&mut state) => lanes.state.put(bytes).await?,
            closed = session_closed(&mut closing, hub.id()) => return say_farewell(zenoh, hub.id(), &closed).await,
            bytes = newest(&mut pose) => lanes.pose.put(bytes).await?,
            bytes = newest(&mut shared) => lanes.shared.put(bytes).await?,
            Ok(bytes) = refusals.recv() => refuse(zenoh, hub, bytes).await?,
            bytes = newest(&mut preview) => lanes.preview.put(bytes).await?,
            Some(bytes) = model.next() => lanes.model.put(bytes).await?,
        }
    }
}

/// Refusals of single pairs go to the cart that feeds the session, where that is one on zenoh.
async fn refuse(zenoh: &zenoh::Session, hub: &Hub, bytes: Bytes) -> Result<(), ZenohError> {
    match hub.source() {
        Some(SourceId::Zenoh(cart)) => Ok(zenoh.put(keys::reply(hub.id(), &cart), bytes).await?),
        Some(SourceId::WebSocket(_) | SourceId::Replay | SourceId::Journal) | None => Ok(()),
    }
}

async fn say_farewell(zenoh: &zenoh::Session, id: &SessionId, closing: &Closing) -> Result<(), ZenohError> {
    Ok(zenoh.put(Lane::Control.key(id), protocol::from_server(farewell(closing))).await?)
}
