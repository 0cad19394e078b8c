//! What zenoh peers ask for and must wait for: calibration, greeting, snapshots, refusals.

use std::sync::Arc;

use protocol::keys;
use protocol::v1::{Calibration, Hello, Reason, Refusal, from_server, to_server};
use protocol::{Bytes, ProtocolError, SessionId};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use zenoh::bytes::ZBytes;
use zenoh::query::Query;
use zenoh::sample::Sample;

use crate::convert;
use crate::http::off_runtime;
use crate::http::socket::{answer, own_hello};
use crate::publish::model_lane::{Seed, ViewerWishes};
use crate::publish::zenoh::ZenohError;
use crate::session::intake::Rejection;
use crate::session::lifecycle::SourceId;
use crate::session::registry::{FeedWanted, Opening, Registry};

/// Something that a callback leaves to the task.
pub(super) enum Request {
    /// A query with a calibration, to be answered.
    Calibration(Query),
    /// A calibration that was put; only a refusal is answered.
    CalibrationPut(Sample),
    /// A query with a hello or a shared change.
    Control(Query),
    /// A query for the whole model.
    Snapshot(Query),
    /// A refusal to be sent to a cart.
    Refusal {
        /// Where the cart listens.
        key: String,
        /// What it is told.
        refusal: Refusal,
    },
}

/// A message of a named cart.
pub(super) struct Message {
    /// The cart.
    pub source: SessionId,
    /// What it says.
    pub body: to_server::Body,
    /// The takeover token that it presents, or an empty text.
    pub takeover_token: String,
}

impl Message {
    /// # Errors
    /// [`Rejection`]: over the limit (before anything is copied), no envelope, no name, no body.
    pub fn read(payload: &ZBytes, limit_bytes: usize) -> Result<Self, Rejection> {
        let envelope = read_envelope(payload, limit_bytes)?;
        let malformed = |text: String| Rejection::new(Reason::MalformedMessage, text);
        let source =
            envelope.source.parse().map_err(|error: ProtocolError| malformed(format!("source: {error}")))?;
        let takeover_token = envelope.takeover_token;
        Ok(Self { source, body: envelope.body.ok_or_else(misplaced)?, takeover_token })
    }
}

fn read_envelope(payload: &ZBytes, limit_bytes: usize) -> Result<protocol::v1::ToServer, Rejection> {
    if payload.len() > limit_bytes {
        let error = ProtocolError::Oversized { bytes: payload.len(), limit: limit_bytes };
        return Err(Rejection::new(Reason::OversizedMessage, error.to_string()));
    }
    protocol::decode_to_server(Bytes::from(payload.to_bytes().into_owned()), limit_bytes)
        .map_err(|error| Rejection::new(Reason::MalformedMessage, error.to_string()))
}

/// A message that may not come where it came.
pub(super) fn misplaced() -> Rejection {
    Rejection::new(Reason::MalformedMessage, "this message does not belong on this key")
}

fn session_of(key: &str) -> Result<SessionId, Rejection> {
    let (id, _) =
        keys::parse(key).map_err(|error| Rejection::new(Reason::InvalidSessionId, error.to_string()))?;
    Ok(id)
}

/// Answers requests, one at a time.
pub(super) struct Requests {
    pub zenoh: zenoh::Session,
    pub registry: Arc<Registry>,
    pub message_max_bytes: usize,
    /// Snapshots that may be packed and sent at a time.
    pub snapshots: Arc<Semaphore>,
}

impl Requests {
    /// # Errors
    /// [`ZenohError`] where the answer cannot be sent.
    pub async fn answer(&self, request: Request) -> Result<(), ZenohError> {
        match request {
            Request::Calibration(query) => {
                let payload = query.payload().cloned().unwrap_or_default();
                let outcome = self.take_calibration(query.key_expr().as_str(), &payload).await;
                let hello = |takeover_token| encode_hello(Hello { takeover_token, ..own_hello() });
                reply(&query, outcome.map(|token| vec![hello(token)])).await
            }
            Request::CalibrationPut(put) => self.answer_put(&put).await,
            Request::Control(query) => {
                let payload = query.payload().cloned().unwrap_or_default();
                let id = session_of(query.key_expr().as_str());
                reply(&query, id.and_then(|id| self.control(&id, &payload)).map(|said| vec![said])).await
            }
            Request::Snapshot(query) => self.answer_with_snapshot(query).await,
            Request::Refusal { key, refusal } => self.refuse(key, refusal).await,
        }
    }

    /// Packing the model takes a while: other requests do not wait for it.
    async fn answer_with_snapshot(&self, query: Query) -> Result<(), ZenohError> {
        let found = session_of(query.key_expr().as_str())
            .and_then(|id| self.registry.find(id.as_str()))
            .and_then(|session| Ok((session, self.wishes(&query)?, self.snapshot_slot()?)));
        let (session, wishes, slot) = match found {
            Ok(found) => found,
            Err(rejection) => return reply(&query, Err(rejection)).await,
        };
        tokio::spawn(async move {
            let _slot = slot;
            let model = session.hub().model.subscribe(Seed::Whole);
            model.set_wishes(wishes);
            let chunks = model.whole().await;
            let ended = || Rejection::new(Reason::UnknownSession, "the session has ended");
            if let Err(error) = reply(&query, chunks.ok_or_else(ended)).await {
                tracing::warn!(%error, "a snapshot was not sent over zenoh");
            }
        });
        Ok(())
    }

    fn wishes(&self, query: &Query) -> Result<ViewerWishes, Rejection> {
        let Some(payload) = query.payload() else { return Ok(ViewerWishes::default()) };
        match read_envelope(payload, self.message_max_bytes)?.body {
            Some(to_server::Body::View(view)) => Ok(convert::wishes_from_wire(&view)),
            Some(to_server::Body::Resync(_)) | None => Ok(ViewerWishes::default()),
            Some(_) => Err(misplaced()),
        }
    }

    fn snapshot_slot(&self) -> Result<OwnedSemaphorePermit, Rejection> {
        let full = |_| Rejection::new(Reason::Internal, "too many snapshots are under way");
        Arc::clone(&self.snapshots).try_acquire_owned().map_err(full)
    }

    async fn answer_put(&self, put: &Sample) -> Result<(), ZenohError> {
        let key = put.key_expr().as_str();
        let Err(rejection) = self.take_calibration(key, put.payload()).await else { return Ok(()) };
        let refusal = protocol::refusal(rejection.reason, rejection.text, None);
        match (session_of(key), Message::read(put.payload(), self.message_max_bytes)) {
            (Ok(id), Ok(message)) => self.refuse(keys::reply(&id, &message.source), refusal).await,
            // Nobody can be told: the sender is not known.
            _ => Ok(()),
        }
    }

    async fn refuse(&self, key: String, refusal: Refusal) -> Result<(), ZenohError> {
        let bytes = protocol::from_server(from_server::Body::Refusal(refusal));
        Ok(self.zenoh.put(key, bytes).await?)
    }

    /// A hello, which needs no session, or a change of what the session's viewers share.
    fn control(&self, id: &SessionId, payload: &ZBytes) -> Result<Bytes, Rejection> {
        match read_envelope(payload, self.message_max_bytes)?.body {
            Some(to_server::Body::Hello(hello)) => answer(&hello).map(encode_hello),
            Some(to_server::Body::SharedChange(change)) => {
                self.registry.find(id.as_str())?.hub().change_shared(change)
            }
            _ => Err(misplaced()),
        }
    }

    /// The cart feeds the session of the key from now on, which is opened where there is none. Gives its takeover token.
    async fn take_calibration(&self, key: &str, payload: &ZBytes) -> Result<String, Rejection> {
        let id = session_of(key)?;
        let message = Message::read(payload, self.message_max_bytes)?;
        let to_server::Body::Calibration(calibration) = message.body else { return Err(misplaced()) };
        let claim = (SourceId::Zenoh(message.source), message.takeover_token);
        let registry = Arc::clone(&self.registry);
        // Building a reconstruction blocks, so it happens off the async runtime.
        off_runtime(move || calibrate(&registry, id, claim, calibration)).await?
    }
}

fn calibrate(
    registry: &Registry,
    id: SessionId,
    (source, presented): (SourceId, String),
    calibration: Calibration,
) -> Result<String, Rejection> {
    let session = match registry.get(&id) {
        Some(session) => {
            session.hub().join(source, &presented)?;
            registry.recalibrate(&session, &calibration)?;
            session
        }
        None => {
            let feed = FeedWanted::Cart(Box::new(calibration));
            let session = registry.open(&Opening { id: Some(id), record: false, feed })?;
            session.hub().join(source, &presented)?;
            session
        }
    };
    Ok(session.hub().takeover_token().to_owned())
}

fn encode_hello(hello: Hello) -> Bytes {
    protocol::from_server(from_server::Body::Hello(hello))
}

async fn reply(query: &Query, outcome: Result<Vec<Bytes>, Rejection>) -> Result<(), ZenohError> {
    match outcome {
        Ok(messages) => {
            for message in messages {
                query.reply(query.key_expr(), message).await?;
            }
        }
        Err(Rejection { reason, text }) => {
            let refusal = from_server::Body::Refusal(protocol::refusal(reason, text, None));
            query.reply_err(protocol::from_server(refusal)).await?;
        }
    }
    Ok(())
}
