//! zenoh: a client of the one endpoint given, without scouting.

use std::time::Duration;

use protocol::keys::{self, Lane};
use protocol::v1::{StereoPair, from_server, to_server};
use protocol::{Bytes, SessionId};
use tokio::sync::mpsc;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::sample::{Sample, SampleKind};

use super::{Joined, LinkError, Purpose, SOFTWARE, expect_hello, read};

/// Opening a session may build GPU pipelines first.
const OPEN_TIMEOUT: Duration = Duration::from_secs(60);
/// Time for the transport to come up.
const CONNECT_TIMEOUT_MS: u64 = 5_000;
/// Poses and refusals that wait; a cart that is this far behind wants only newer ones.
const INCOMING_MAX: usize = 64;

pub struct ZenohLink {
    session: Session,
    source: SessionId,
    pairs: Publisher<'static>,
    incoming: mpsc::Receiver<Incoming>,
    _token: LivelinessToken,
    _subscribers: [Subscriber<()>; 3],
}

enum Incoming {
    Message(Bytes),
    ServerGone,
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
        let (sender, incoming) = mpsc::channel(INCOMING_MAX);
        let forward = || {
            let sender = sender.clone();
            move |sample: Sample| {
                let bytes = Bytes::from(sample.payload().to_bytes().into_owned());
                // Full: a newer pose follows, and the server counts what it refuses.
                let _ = sender.try_send(Incoming::Message(bytes));
            }
        };
        let poses = session.declare_subscriber(Lane::Pose.key(id)).callback(forward()).await?;
        let replies = session.declare_subscriber(keys::reply(id, &source)).callback(forward()).await?;
        let server = session
            .liveliness()
            .declare_subscriber(keys::server_token(id))
            .callback(move |token: Sample| {
                if token.kind() == SampleKind::Delete {
                    // Full: `receive` is far behind and will see silence; the server's end is noticed by the next send.
                    let _ = sender.try_send(Incoming::ServerGone);
                }
            })
            .await?;
        let pairs = session
            .declare_publisher(Lane::IngestStereo.key(id))
            .congestion_control(CongestionControl::Block)
            .await?;
        Ok(Self { session, source, pairs, incoming, _token: token, _subscribers: [poses, replies, server] })
    }

    async fn calibrate(&self, id: &SessionId, purpose: &Purpose) -> Result<String, LinkError> {
        let hello = to_server::Body::Hello(protocol::hello(SOFTWARE));
        let hello = protocol::to_server(hello, Some(&self.source));
        expect_hello(self.ask(&Lane::Control.key(id), hello).await?)?;
        let calibration = to_server::Body::Calibration(purpose.calibration.clone());
        let calibration = protocol::to_server_taking_over(calibration, &self.source, &purpose.takeover_token);
        expect_hello(self.ask(&Lane::IngestCalibration.key(id), calibration).await?)
    }

    /// The first answer to a query; a refusal is an answer too.
    async fn ask(&self, key: &str, envelope: Bytes) -> Result<Option<from_server::Body>, LinkError> {
        let answers =
            self.session.get(key).payload(envelope).timeout(OPEN_TIMEOUT).await.map_err(LinkError::lost)?;
        let answer = answers.recv_async().await.map_err(|_| LinkError::lost("no server answers"))?;
        let payload = match answer.result() {
            Ok(sample) => sample.payload(),
            Err(error) => error.payload(),
        };
        read(Bytes::from(payload.to_bytes().into_owned()))
    }

    pub async fn send(&mut self, pair: StereoPair) -> Result<(), LinkError> {
        let bytes = protocol::to_server(to_server::Body::Pair(pair), Some(&self.source));
        self.pairs.put(bytes).await.map_err(LinkError::lost)
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        loop {
            match self.incoming.recv().await {
                Some(Incoming::Message(bytes)) => {
                    if let Some(body) = read(bytes)? {
                        return Ok(body);
                    }
                }
                Some(Incoming::ServerGone) => return Err(LinkError::lost("the server is gone")),
                None => return Err(LinkError::lost("the zenoh session ended")),
            }
        }
    }

    pub async fn close(self) {
        // The server may be gone already.
        let _ = self.session.close().await;
    }
}

async fn open(endpoint: &str) -> zenoh::Result<Session> {
    let mut config = zenoh::Config::default();
    for (key, value) in [
        ("mode", serde_json::json!("client")),
        ("connect/endpoints", serde_json::json!([endpoint])),
        ("connect/timeout_ms", serde_json::json!(CONNECT_TIMEOUT_MS)),
        ("connect/exit_on_failure", serde_json::json!(true)),
        ("scouting/multicast/enabled", serde_json::json!(false)),
        ("scouting/gossip/enabled", serde_json::json!(false)),
    ] {
        config.insert_json5(key, &value.to_string())?;
    }
    zenoh::open(config).await
}
