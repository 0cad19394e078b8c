//! Carts on zenoh. Callbacks only put things in slots; whatever blocks or waits happens in
//! [`Requests`].

use std::sync::Arc;

use protocol::SessionId;
use protocol::keys::{self, Lane};
use protocol::v1::{StereoPair, to_server};
use tokio::sync::{Semaphore, mpsc};
use zenoh::bytes::ZBytes;
use zenoh::query::Query;
use zenoh::sample::{Sample, SampleKind};

use super::ZenohConfig;
use super::zenoh_requests::{Message, Request, Requests, misplaced};
use crate::publish::zenoh::ZenohError;
use crate::session::intake::Rejection;
use crate::session::lifecycle::SourceId;
use crate::session::registry::Registry;

/// Calibrations, queries and refusals that wait; more are dropped and logged.
const REQUESTS_WAITING_MAX: usize = 64;
/// Snapshots that are packed and sent at a time.
const SNAPSHOTS_MAX: usize = 64;

/// Opens the peer: only the endpoints of the configuration, no scouting.
///
/// # Errors
/// [`ZenohError`] where an endpoint cannot be had.
pub async fn open(config: &ZenohConfig, message_max_bytes: usize) -> Result<zenoh::Session, ZenohError> {
    let mut settings = zenoh::Config::default();
    for (key, value) in [
        ("mode", serde_json::json!("peer")),
        ("listen/endpoints", serde_json::json!(config.listen)),
        ("connect/endpoints", serde_json::json!(config.connect)),
        ("scouting/multicast/enabled", serde_json::json!(false)),
        ("scouting/gossip/enabled", serde_json::json!(false)),
        ("transport/link/rx/max_message_size", serde_json::json!(message_max_bytes)),
    ] {
        settings.insert_json5(key, &value.to_string())?;
    }
    Ok(zenoh::open(settings).await?)
}

/// What callbacks share.
#[derive(Clone)]
struct Callbacks {
    registry: Arc<Registry>,
    requests: mpsc::Sender<Request>,
    message_max_bytes: usize,
}

/// Serves carts and queries until the task is ended.
///
/// # Errors
/// [`ZenohError`] where something cannot be declared.
pub async fn serve(
    zenoh: zenoh::Session,
    registry: Arc<Registry>,
    message_max_bytes: usize,
) -> Result<(), ZenohError> {
    let (requests, mut waiting) = mpsc::channel(REQUESTS_WAITING_MAX);
    let callbacks = Callbacks { registry: Arc::clone(&registry), requests, message_max_bytes };
    let query = |key: &'static str, request: fn(Query) -> Request| {
        let callbacks = callbacks.clone();
        zenoh.declare_queryable(key).callback(move |query| callbacks.request(request(query)))
    };
    let _calibrations = query(keys::ALL_CALIBRATION, Request::Calibration).await?;
    let _control = query(keys::ALL_CONTROL, Request::Control).await?;
    let _snapshots = query(keys::ALL_SNAPSHOTS, Request::Snapshot).await?;
    let on_sample = callbacks.clone();
    let _puts = zenoh.declare_subscriber(keys::ALL_INGEST).callback(move |put| on_sample.take(put)).await?;
    let _sources = zenoh
        .liveliness()
        .declare_subscriber(keys::ALL_SOURCES)
        .callback(move |token| callbacks.note_liveliness(&token))
        .await?;
    let snapshots = Arc::new(Semaphore::new(SNAPSHOTS_MAX));
    let requests = Requests { zenoh: zenoh.clone(), registry, message_max_bytes, snapshots };
    while let Some(request) = waiting.recv().await {
        if let Err(error) = requests.answer(request).await {
            tracing::warn!(%error, "a zenoh request was not answered");
        }
    }
    Ok(())
}

impl Callbacks {
    fn request(&self, request: Request) {
        if self.requests.try_send(request).is_err() {
            tracing::warn!("too many zenoh requests at once; one was dropped");
        }
    }

    /// A put below `ingest/`.
    fn take(&self, put: Sample) {
        match keys::parse(put.key_expr().as_str()) {
            Ok((id, Some(Lane::IngestStereo))) => self.take_pair(&id, put.payload()),
            Ok((_, Some(Lane::IngestCalibration))) => self.request(Request::CalibrationPut(put)),
            // A foreign key, or a lane of a later version.
            _ => {}
        }
    }

    fn take_pair(&self, id: &SessionId, payload: &ZBytes) {
        let Message { source, body, .. } = match Message::read(payload, self.message_max_bytes) {
            Ok(message) => message,
            // Nobody can be told: the sender is not known.
            Err(rejection) => return tracing::debug!(session = %id, %rejection, "refused over zenoh"),
        };
        let (sequence, outcome) = match body {
            to_server::Body::Pair(pair) => (Some(pair.sequence), self.offer(id, &source, pair)),
            _ => (None, Err(misplaced())),
        };
        if let Err(rejection) = outcome {
            let refusal = protocol::refusal(rejection.reason, rejection.text, sequence);
            self.request(Request::Refusal { key: keys::reply(id, &source), refusal });
        }
    }

    /// A cart that was lost and found again goes on without a new calibration.
    fn offer(&self, id: &SessionId, source: &SessionId, pair: StereoPair) -> Result<(), Rejection> {
        let session = self.registry.find(id.as_str())?;
        let source = SourceId::Zenoh(source.clone());
        if !session.hub().is_fed_by(&source) {
            session.hub().join(source.clone(), "")?;
        }
        session.offer(&source, pair)
    }

    /// A cart that is gone is a lost source at once.
    fn note_liveliness(&self, token: &Sample) {
        if token.kind() != SampleKind::Delete {
            return;
        }
        if let Ok((id, source)) = keys::parse_source_token(token.key_expr().as_str())
            && let Some(session) = self.registry.get(&id)
        {
            session.hub().leave(&SourceId::Zenoh(source));
        }
    }
}
