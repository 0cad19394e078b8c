//! The model lane: a snapshot on joining, then every epoch in order; who lags is seeded anew.
//!
//! Epochs are encoded once, and all viewers share the bytes. One lock guards the account of what they hold and all
//! queues, so a viewer gets its snapshot and its place among the epochs in one atomic step; it is never held while a
//! snapshot is packed. Epochs are never dropped singly: a queue that lags is given up as a whole.

mod detail;
mod queue;
mod seed;
mod subscription;
#[cfg(test)]
mod tests;
mod update;

pub use detail::ViewerWishes;
pub use subscription::{ModelSubscription, Seed};
pub use update::{ModelUpdate, NodeChanges, Published};

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use protocol::v1::{ModelEpoch, from_server};
use protocol::{PackedModel, ProtocolError, WireSurfel};

use queue::{EncodedEpoch, Queue};
use seed::SeedBase;

/// What one viewer may lag behind.
#[derive(Clone, Copy, Debug)]
pub struct LagLimits {
    /// Bytes of epochs that wait for it.
    pub bytes: usize,
    /// Age of the oldest of them.
    pub age: Duration,
}

/// The lane; cheap to share.
#[derive(Clone)]
pub struct ModelLane {
    shared: Arc<Mutex<State>>,
    limits: LagLimits,
}

#[derive(Default)]
struct State {
    model: PackedModel,
    /// The newest snapshot and the epochs since.
    base: Option<BaseAndTail>,
    /// Somebody waits for shapes that only the GPU has.
    shapes_wanted: bool,
    /// Where the scope is: what viewers look at who do not say.
    scope_in_world_m: Option<[f32; 3]>,
    queues: BTreeMap<u64, Queue>,
    next_queue: u64,
    closed: bool,
}

struct BaseAndTail {
    base: Arc<SeedBase>,
    tail: Vec<Arc<EncodedEpoch>>,
    tail_bytes: usize,
}

impl ModelLane {
    /// An empty model.
    pub fn new(limits: LagLimits) -> Self {
        Self { shared: Arc::default(), limits }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes an update the next epoch and queues it for all viewers.
    ///
    /// # Errors
    /// [`ProtocolError`] where ids are not increasing or the nodes are not those held; nothing is then published.
    pub fn publish(&self, update: &ModelUpdate) -> Result<Published, ProtocolError> {
        let mut state = self.lock();
        let (changes, unpackable) = update::reconcile(&state.model, update)?;
        let message = state.advance(changes, &self.limits)?;
        let (epoch, surfels) = (state.model.epoch(), state.model.surfels().len());
        Ok(Published { epoch, surfels, message, unpackable })
    }

    /// Empties the model in a next epoch: the reconstruction starts anew.
    ///
    /// # Errors
    /// None in practice: the ids are the model's own.
    pub fn clear(&self) -> Result<(), ProtocolError> {
        let mut state = self.lock();
        if state.model.surfels().is_empty() && state.model.nodes().is_empty() {
            return Ok(());
        }
        let changes = state.model.clearing()?;
        state.advance(changes, &self.limits).map(|_| ())
    }

    /// Epoch and surfels that viewers hold.
    pub fn extent(&self) -> (u32, usize) {
        let state = self.lock();
        (state.model.epoch(), state.model.surfels().len())
    }

    /// Viewers that follow.
    pub fn viewers(&self) -> usize {
        self.lock().queues.values().filter(|queue| queue.is_viewer()).count()
    }

    /// Bytes that wait for the viewer that is most behind.
    pub fn backlog_bytes(&self) -> usize {
        self.lock().queues.values().map(Queue::waiting_bytes).max().unwrap_or(0)
    }

    /// Where the scope is now: snapshots go out from there for viewers that do not say what they look at.
    pub fn set_scope(&self, position_in_world_m: [f32; 3]) {
        self.lock().scope_in_world_m = Some(position_in_world_m);
    }

    /// Whether somebody waits for the shapes of the surfels as viewers hold them, to be handed to
    /// [`Self::bring_shapes`].
    pub fn wants_shapes(&self) -> bool {
        self.lock().shapes_wanted
    }

    /// Takes over the shapes that viewers hold at the present epoch, right after it was published: all surfels.
    pub fn bring_shapes(&self, shapes: Vec<WireSurfel>) {
        let mut state = self.lock();
        state.shapes_wanted = false;
        state.rebase(Some(shapes));
        state.wake_all();
    }

    /// Joins: what is there and what will come, without a gap.
    pub fn subscribe(&self, seed: Seed) -> ModelSubscription {
        let mut state = self.lock();
        let id = state.next_queue;
        state.next_queue += 1;
        let queue = Queue::new(seed, Instant::now());
        let filled = queue.filled();
        state.queues.insert(id, queue);
        drop(state);
        ModelSubscription::new(self.clone(), id, filled)
    }

    /// Ends all subscriptions once they have taken what waits.
    pub fn close(&self) {
        let mut state = self.lock();
        state.closed = true;
        state.wake_all();
    }
}

impl State {
    fn advance(&mut self, changes: ModelEpoch, limits: &LagLimits) -> Result<protocol::Bytes, ProtocolError> {
        let epoch = self.model.advance(changes)?;
        let bytes = protocol::from_server_compressed(from_server::Body::Epoch(epoch.clone()));
        let encoded = Arc::new(EncodedEpoch { bytes: bytes.clone(), epoch });
        self.extend_tail(&encoded, limits);
        let now = Instant::now();
        for queue in self.queues.values_mut() {
            queue.push(&encoded, limits, now);
        }
        Ok(bytes)
    }

    /// A snapshot is of use as long as the epochs since are few bytes.
    fn extend_tail(&mut self, epoch: &Arc<EncodedEpoch>, limits: &LagLimits) {
        let Some(held) = &mut self.base else { return };
        held.tail_bytes += epoch.bytes.len();
        if held.tail_bytes > limits.bytes / 16 {
            self.base = None;
        } else {
            held.tail.push(Arc::clone(epoch));
        }
    }

    /// Starts a snapshot of the present epoch; `shapes` are needed where a warp has moved the surfels.
    fn rebase(&mut self, shapes: Option<Vec<WireSurfel>>) {
        let base = Arc::new(SeedBase::new(self.model.clone(), shapes));
        self.base = Some(BaseAndTail { base, tail: Vec::new(), tail_bytes: 0 });
    }

    /// The snapshot to seed from and the epochs since, or `None` while the shapes for it are still to come.
    fn seed(&mut self, without_tail: bool) -> Option<(Arc<SeedBase>, Vec<Arc<EncodedEpoch>>)> {
        if self.base.as_ref().is_none_or(|held| without_tail && !held.tail.is_empty()) {
            if self.model.is_outdated() {
                self.shapes_wanted = true;
                return None;
            }
            self.rebase(None);
        }
        self.base.as_ref().map(|held| (Arc::clone(&held.base), held.tail.clone()))
    }

    fn wake_all(&self) {
        self.queues.values().for_each(Queue::wake);
    }
}
