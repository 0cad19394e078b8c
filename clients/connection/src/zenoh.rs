//! zenoh: a client of the one endpoint given, without scouting.

use std::time::Duration;

use protocol::v1::from_server;
use protocol::{Bytes, SessionId, keys};
use tokio::sync::mpsc;
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::query::Reply;
use zenoh::sample::{Sample, SampleKind};

use crate::{LinkError, read};

/// Time for the transport to come up.
const CONNECT_TIMEOUT_MS: u64 = 5_000;

/// Connects to the endpoint and looks for nothing else.
///
/// # Errors
/// zenoh's.
pub async fn open(endpoint: &str) -> zenoh::Result<Session> {
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

/// The first answer to a query; a refusal is an answer too.
///
/// # Errors
/// [`LinkError::Lost`].
pub async fn ask(
    session: &Session,
    key: &str,
    envelope: Bytes,
    timeout: Duration,
) -> Result<Option<from_server::Body>, LinkError> {
    let answers = session.get(key).payload(envelope).timeout(timeout).await.map_err(LinkError::lost)?;
    let answer = answers.recv_async().await.map_err(|_| LinkError::lost("no server answers"))?;
    read(bytes_of(payload_of(&answer)))
}

enum Incoming {
    Message(Bytes),
    ServerGone,
}

/// Where zenoh's callbacks put what comes.
#[derive(Clone)]
pub struct Outlet(mpsc::Sender<Incoming>);

/// What came and was not yet taken.
pub struct Inbox(mpsc::Receiver<Incoming>);

/// A queue of at most `capacity` messages. What comes when it is full is lost: the caller must live with that.
pub fn inbox(capacity: usize) -> (Outlet, Inbox) {
    let (sender, receiver) = mpsc::channel(capacity);
    (Outlet(sender), Inbox(receiver))
}

impl Outlet {
    /// A callback of a subscriber.
    pub fn samples(&self) -> impl Fn(Sample) + Send + Sync + use<> {
        let sender = self.0.clone();
        move |sample| {
            // Full: see `inbox`.
            let _ = sender.try_send(Incoming::Message(bytes_of(sample.payload())));
        }
    }

    /// A callback of a query.
    pub fn replies(&self) -> impl Fn(Reply) + Send + Sync + use<> {
        let sender = self.0.clone();
        move |reply| {
            // Full: see `inbox`.
            let _ = sender.try_send(Incoming::Message(bytes_of(payload_of(&reply))));
        }
    }

    /// Tells when the server of a session goes.
    ///
    /// # Errors
    /// zenoh's.
    pub async fn watch_server(&self, session: &Session, id: &SessionId) -> zenoh::Result<Subscriber<()>> {
        let sender = self.0.clone();
        let gone = move |token: Sample| {
            if token.kind() == SampleKind::Delete {
                // Full: silence, or the next send, tells too.
                let _ = sender.try_send(Incoming::ServerGone);
            }
        };
        session.liveliness().declare_subscriber(keys::server_token(id)).callback(gone).await
    }
}

impl Inbox {
    /// What the server says next. Nothing is lost when the future is dropped before it is ready.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub async fn receive(&mut self) -> Result<from_server::Body, LinkError> {
        loop {
            match self.0.recv().await {
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
}

fn bytes_of(payload: &ZBytes) -> Bytes {
    Bytes::from(payload.to_bytes().into_owned())
}

/// The answer, or the refusal.
fn payload_of(reply: &Reply) -> &ZBytes {
    match reply.result() {
        Ok(sample) => sample.payload(),
        Err(error) => error.payload(),
    }
}
