//! Pairs over zenoh.

use std::time::Duration;

use connection::zenoh::{Inbox, ask, inbox, open};
use connection::{LinkError, expect_hello};
use protocol::SessionId;
use protocol::keys::{self, Lane};
use protocol::v1::{StereoPair, from_server, to_server};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;

use super::{Joined, Purpose, SOFTWARE};

/// Opening a session may build GPU pipelines first.
const OPEN_TIMEOUT: Duration = Duration::from_secs(60);
/// Poses and refusals that wait; a cart that is this far behind wants only newer ones, and the server counts what it
/// refuses.
const INCOMING_MAX: usize = 64;

pub struct ZenohLink {
    session: Session,
    source: SessionId,
    pairs: Publisher<'static>,
    inbox: Inbox,
    _token: LivelinessToken,
    _subscribers: [Subscriber<()>; 4],
}

impl ZenohLink {
    pub async fn connect(endpoint: &str, purpose: &Purpose) -> Result<(Self, Joined), LinkError> {
        let session = open(endpoint).await.map_err(LinkError::lost)?;
        let source: SessionId = format!("cart-{}", session.zid()).parse().map_err(LinkError::lost)?;
        let id = match &purpose.session {
            Some(id) => id.clone(),
            None => format!("zenoh-{}", session.zid()).parse().map_err(LinkError::lost)?,
        };
        let link = Self::declare(session, source, &id).await.map_err(LinkError::lost)?;
        let takeover_token = link.calibrate(&id, purpose).await?;
        Ok((link, Joined { session: id, takeover_token }))
    }

    /// The token comes first, so that the server never knows the cart without it.
    async fn declare(session: Session, source: SessionId, id: &SessionId) -> zenoh::Result<Self> {
        let token = session.liveliness().declare_token(keys::source_token(id, &source)).await?;
        let (outlet, inbox) = inbox(INCOMING_MAX);
        let poses = session.declare_subscriber(Lane::Pose.key(id)).callback(outlet.samples()).await?;
        let replies = session.declare_subscriber(keys::reply(id, &source)).callback(outlet.samples()).await?;
        let control = session.declare_subscriber(Lane::Control.key(id)).callback(outlet.samples()).await?;
        let server = outlet.watch_server(&session, id).await?;
        let pairs = session
            .declare_publisher(Lane::IngestStereo.key(id))
            .congestion_control(CongestionControl::Block)
            .await?;
        Ok(Self {
            session,
            source,
            pairs,
            inbox,
            _token: token,
            _subscribers: [poses, replies, control, server],
        })
    }

    async fn calibrate(&self, id: &SessionId, purpose: &Purpose) -> Result<String, LinkError> {
        let hello = to_server::Body::Hello(protocol::hello(SOFTWARE));
        let hello = protocol::to_server(hello, Some(&self.source));
        expect_hello(ask(&self.session, &Lane::Control.key(id), hello, OPEN_TIMEOUT).await?)?;
        let calibration = to_server::Body::Calibration(purpose.calibration.clone());
        let calibration = protocol::to_server_taking_over(calibration, &self.source, &purpose.takeover_token);
        expect_hello(ask(&self.session, &Lane::IngestCalibration.key(id), calibration, OPEN_TIMEOUT).await?)
    }

    pub async fn send(&mut self, pair: StereoPair) -> Result<(), LinkError> {
        let bytes = protocol::to_server(to_server::Body::Pair(pair), Some(&self.source));
        self.pairs.put(bytes).await.map_err(LinkError::lost)
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        self.inbox.receive().await
    }

    pub async fn close(self) {
        // The server may be gone already.
        let _ = self.session.close().await;
    }
}
