//! zenoh: a client of the one endpoint given, without scouting.

use std::time::Duration;

use protocol::keys::{self, Lane};
use protocol::v1::{from_server, to_server};
use protocol::{Bytes, SessionId};
use tokio::sync::mpsc;
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::qos::Priority;
use zenoh::query::{ConsolidationMode, Reply};
use zenoh::sample::{Sample, SampleKind};

use super::{LinkError, SOFTWARE, expect_hello, read};

/// Time for an answer to a greeting.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// Time for a whole snapshot.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_secs(60);
/// Time for the transport to come up.
const CONNECT_TIMEOUT_MS: u64 = 5_000;
/// Messages that wait; beyond it they are lost, which the epochs' bases tell, and the model is asked for again.
const INCOMING_MAX: usize = 1024;
/// What a viewer listens to.
const LANES: [Lane; 4] = [Lane::ModelEpoch, Lane::Pose, Lane::State, Lane::Control];

pub struct ZenohLink {
    session: Session,
    id: SessionId,
    outgoing: mpsc::Sender<Incoming>,
    incoming: mpsc::Receiver<Incoming>,
    _subscribers: Vec<Subscriber<()>>,
}

enum Incoming {
    Message(Bytes),
    ServerGone,
}

impl ZenohLink {
    /// Subscribes before it asks for the model, so that no epoch is missed between the two.
    pub async fn connect(endpoint: &str, id: &SessionId) -> Result<Self, LinkError> {
        let session = open(endpoint).await.map_err(LinkError::lost)?;
        greet(&session, id).await?;
        let link = Self::subscribe(session, id.clone()).await.map_err(LinkError::lost)?;
        link.ask_for_snapshot().await?;
        Ok(link)
    }

    async fn subscribe(session: Session, id: SessionId) -> zenoh::Result<Self> {
        let (outgoing, incoming) = mpsc::channel(INCOMING_MAX);
        let mut subscribers = Vec::new();
        for lane in LANES {
            let sender = outgoing.clone();
            let forward = move |sample: Sample| {
                // Full: a lost epoch is noticed by its successor, the others are outdated by theirs.
                let _ = sender.try_send(Incoming::Message(bytes_of(sample.payload())));
            };
            subscribers.push(session.declare_subscriber(lane.key(&id)).callback(forward).await?);
        }
        let sender = outgoing.clone();
        let server = session.liveliness().declare_subscriber(keys::server_token(&id));
        let gone = move |token: Sample| {
            if token.kind() == SampleKind::Delete {
                // Full: silence is noticed too.
                let _ = sender.try_send(Incoming::ServerGone);
            }
        };
        subscribers.push(server.callback(gone).await?);
        Ok(Self { session, id, outgoing, incoming, _subscribers: subscribers })
    }

    /// The chunks come between the other messages. Their priority is below that of epochs, which overtake them.
    pub async fn ask_for_snapshot(&self) -> Result<(), LinkError> {
        let sender = self.outgoing.clone();
        let take = move |reply: Reply| {
            let payload = match reply.result() {
                Ok(sample) => sample.payload(),
                Err(error) => error.payload(),
            };
            // Full: the snapshot stays incomplete and is asked for again.
            let _ = sender.try_send(Incoming::Message(bytes_of(payload)));
        };
        self.session
            .get(Lane::ModelSnapshot.key(&self.id))
            .consolidation(ConsolidationMode::None)
            .priority(Priority::DataLow)
            .timeout(SNAPSHOT_TIMEOUT)
            .callback(take)
            .await
            .map_err(LinkError::lost)
    }

    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        loop {
            match self.incoming.recv().await {
                Some(Incoming::Message(bytes)) => match read(bytes)? {
                    Some(from_server::Body::Refusal(refusal)) => {
                        return Err(LinkError::Refused { reason: refusal.reason(), text: refusal.text });
                    }
                    Some(body) => return Ok(body),
                    None => {}
                },
                Some(Incoming::ServerGone) => return Err(LinkError::lost("the server is gone")),
                None => return Err(LinkError::lost("the zenoh session ended")),
            }
        }
    }
}

fn bytes_of(payload: &ZBytes) -> Bytes {
    Bytes::from(payload.to_bytes().into_owned())
}

async fn greet(session: &Session, id: &SessionId) -> Result<(), LinkError> {
    let hello = protocol::to_server(to_server::Body::Hello(protocol::hello(SOFTWARE)), None);
    let asked = session.get(Lane::Control.key(id)).payload(hello).timeout(ANSWER_TIMEOUT);
    let answers = asked.await.map_err(LinkError::lost)?;
    let answer = answers.recv_async().await.map_err(|_| LinkError::lost("no server answers"))?;
    let payload = match answer.result() {
        Ok(sample) => sample.payload(),
        Err(error) => error.payload(),
    };
    expect_hello(read(bytes_of(payload))?)
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
