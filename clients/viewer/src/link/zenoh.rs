//! All lanes of a session over zenoh.

use std::time::Duration;

use connection::zenoh::{Inbox, Outlet, ask, inbox, open};
use connection::{LinkError, expect_hello};
use protocol::SessionId;
use protocol::keys::Lane;
use protocol::v1::{from_server, to_server};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::qos::Priority;
use zenoh::query::ConsolidationMode;

use super::SOFTWARE;

/// Time for an answer to a greeting.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// Time for a whole snapshot.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_secs(60);
/// Messages that wait. Beyond it a lost epoch is noticed by its successor, an incomplete snapshot is asked for again, and
/// the others are outdated by those that follow.
const INCOMING_MAX: usize = 1024;
/// What a viewer listens to.
const LANES: [Lane; 4] = [Lane::ModelEpoch, Lane::Pose, Lane::State, Lane::Control];

pub struct ZenohLink {
    session: Session,
    id: SessionId,
    outlet: Outlet,
    inbox: Inbox,
    _subscribers: Vec<Subscriber<()>>,
}

impl ZenohLink {
    /// Subscribes before it asks for the model, so that no epoch is missed between the two.
    pub async fn connect(endpoint: &str, id: &SessionId) -> Result<Self, LinkError> {
        let session = open(endpoint).await.map_err(LinkError::lost)?;
        let hello = protocol::to_server(to_server::Body::Hello(protocol::hello(SOFTWARE)), None);
        expect_hello(ask(&session, &Lane::Control.key(id), hello, ANSWER_TIMEOUT).await?)?;
        let link = Self::subscribe(session, id.clone()).await.map_err(LinkError::lost)?;
        link.ask_for_snapshot().await?;
        Ok(link)
    }

    async fn subscribe(session: Session, id: SessionId) -> zenoh::Result<Self> {
        let (outlet, inbox) = inbox(INCOMING_MAX);
        let mut subscribers = Vec::new();
        for lane in LANES {
            subscribers.push(session.declare_subscriber(lane.key(&id)).callback(outlet.samples()).await?);
        }
        subscribers.push(outlet.watch_server(&session, &id).await?);
        Ok(Self { session, id, outlet, inbox, _subscribers: subscribers })
    }

    /// The chunks come between the other messages. Their priority is below that of epochs, which overtake them.
    pub async fn ask_for_snapshot(&self) -> Result<(), LinkError> {
        self.session
            .get(Lane::ModelSnapshot.key(&self.id))
            .consolidation(ConsolidationMode::None)
            .priority(Priority::DataLow)
            .timeout(SNAPSHOT_TIMEOUT)
            .callback(self.outlet.replies())
            .await
            .map_err(LinkError::lost)
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        match self.inbox.receive().await? {
            from_server::Body::Refusal(refusal) => {
                Err(LinkError::Refused { reason: refusal.reason(), text: refusal.text })
            }
            body => Ok(body),
        }
    }
}
