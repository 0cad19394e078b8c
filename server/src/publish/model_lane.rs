//! The model lane: a snapshot on joining, then every epoch in order; who lags is seeded anew.
//!
//! One lock guards the model and all queues, so a viewer gets its snapshot and its place in the queue in one atomic
//! step. Epochs are never dropped singly: a queue over its budget is given up as a whole.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use protocol::v1::{ModelEpoch, from_server};
use protocol::{Bytes, PackedModel, ProtocolError, SurfelRecord, WireSurfel, pack_ids, pack_surfels};
use tokio::sync::Notify;

/// What a session's model did since the last one.
#[derive(Clone, Debug, Default)]
pub struct ModelUpdate {
    /// Stamp of the newest pair in it.
    pub stamp_ns: u64,
    /// Added and changed surfels, by increasing id.
    pub changed: Vec<WireSurfel>,
    /// Removed ids, increasing.
    pub removed: Vec<u32>,
}

impl ModelUpdate {
    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.changed.is_empty() && self.removed.is_empty()
    }
}

/// What became of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Published {
    /// The epoch that it became.
    pub epoch: u32,
    /// Surfels that viewers then hold.
    pub surfels: usize,
    /// Bytes sent to each viewer.
    pub bytes: usize,
    /// Surfels left out because they have no packed form.
    pub unpackable: usize,
}

/// How a subscription starts, and goes on after it lagged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seed {
    /// With the whole model.
    Snapshot,
    /// With the next epoch; the receiver finds the gap by the base epoch and asks for the model itself.
    Nothing,
}

/// The lane; cheap to share.
#[derive(Clone)]
pub struct ModelLane {
    shared: Arc<Mutex<State>>,
    budget_bytes: usize,
}

#[derive(Default)]
struct State {
    model: PackedModel,
    /// The encoded snapshot of the current epoch, once somebody wanted it.
    snapshot: Option<Vec<Bytes>>,
    queues: BTreeMap<u64, Queue>,
    next_queue: u64,
    closed: bool,
}

struct Queue {
    seed: Seed,
    chunks: VecDeque<Bytes>,
    epochs: VecDeque<Bytes>,
    epoch_bytes: usize,
    lagged: bool,
    filled: Arc<Notify>,
}

impl ModelLane {
    /// An empty model; `budget_bytes` of epochs may wait for one viewer.
    pub fn new(budget_bytes: usize) -> Self {
        Self { shared: Arc::default(), budget_bytes }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes an update the next epoch and queues it for all viewers.
    ///
    /// # Errors
    /// [`ProtocolError`] where ids are not increasing; nothing is then published.
    pub fn publish(&self, update: &ModelUpdate) -> Result<Published, ProtocolError> {
        let mut state = self.lock();
        let (changes, unpackable) = reconcile(&state.model, update)?;
        let bytes = state.advance(changes, self.budget_bytes)?;
        let (epoch, surfels) = (state.model.epoch(), state.model.len());
        Ok(Published { epoch, surfels, bytes, unpackable })
    }

    /// Empties the model in a next epoch: the reconstruction starts anew.
    ///
    /// # Errors
    /// None in practice: the ids are the model's own.
    pub fn clear(&self) -> Result<(), ProtocolError> {
        let mut state = self.lock();
        if state.model.is_empty() {
            return Ok(());
        }
        let changes = state.model.clearing();
        state.advance(changes, self.budget_bytes).map(|_| ())
    }

    /// Epoch and surfels that viewers hold.
    pub fn extent(&self) -> (u32, usize) {
        let state = self.lock();
        (state.model.epoch(), state.model.len())
    }

    /// Viewers that follow.
    pub fn viewers(&self) -> usize {
        self.lock().queues.values().filter(|queue| queue.seed == Seed::Snapshot).count()
    }

    /// The whole model as encoded chunks, shared by all who ask at this epoch.
    pub fn snapshot(&self) -> Vec<Bytes> {
        self.lock().snapshot()
    }

    /// Joins: what is there and what will come, without a gap.
    pub fn subscribe(&self, seed: Seed) -> ModelSubscription {
        let mut state = self.lock();
        let filled = Arc::new(Notify::new());
        let mut queue = Queue {
            seed,
            chunks: VecDeque::new(),
            epochs: VecDeque::new(),
            epoch_bytes: 0,
            lagged: true,
            filled: Arc::clone(&filled),
        };
        state.reseed(&mut queue);
        let id = state.next_queue;
        state.next_queue += 1;
        state.queues.insert(id, queue);
        ModelSubscription { lane: self.clone(), id, filled }
    }

    /// Ends all subscriptions once they have taken what waits.
    pub fn close(&self) {
        let mut state = self.lock();
        state.closed = true;
        state.queues.values().for_each(|queue| queue.filled.notify_one());
    }
}

impl State {
    fn advance(&mut self, changes: ModelEpoch, budget_bytes: usize) -> Result<usize, ProtocolError> {
        let epoch = self.model.advance(changes)?;
        self.snapshot = None;
        let bytes = protocol::from_server(from_server::Body::Epoch(epoch));
        for queue in self.queues.values_mut() {
            queue.push(&bytes, budget_bytes);
        }
        Ok(bytes.len())
    }

    fn snapshot(&mut self) -> Vec<Bytes> {
        let model = &self.model;
        let encode = |chunk| protocol::from_server(from_server::Body::Snapshot(chunk));
        self.snapshot.get_or_insert_with(|| model.snapshot().into_iter().map(encode).collect()).clone()
    }

    fn reseed(&mut self, queue: &mut Queue) {
        queue.lagged = false;
        if queue.seed == Seed::Snapshot {
            queue.chunks = self.snapshot().into();
        }
    }

    /// The next message of a queue; `None` while it is empty.
    fn pop(&mut self, id: u64) -> Option<Bytes> {
        let mut queue = self.queues.remove(&id)?;
        // A snapshot under way is finished first, so that a slow viewer sees some model rather than none.
        if queue.chunks.is_empty() && queue.lagged {
            self.reseed(&mut queue);
        }
        let message = queue.pop();
        self.queues.insert(id, queue);
        message
    }
}

impl Queue {
    fn push(&mut self, epoch: &Bytes, budget_bytes: usize) {
        if self.lagged {
            return;
        }
        self.epoch_bytes += epoch.len();
        self.epochs.push_back(epoch.clone());
        if self.epoch_bytes > budget_bytes {
            self.epochs.clear();
            self.epoch_bytes = 0;
            self.lagged = true;
        }
        self.filled.notify_one();
    }

    fn pop(&mut self) -> Option<Bytes> {
        if let Some(chunk) = self.chunks.pop_front() {
            return Some(chunk);
        }
        let epoch = self.epochs.pop_front()?;
        self.epoch_bytes -= epoch.len();
        Some(epoch)
    }
}

/// One viewer's place in the lane; leaves it when dropped.
pub struct ModelSubscription {
    lane: ModelLane,
    id: u64,
    filled: Arc<Notify>,
}

impl ModelSubscription {
    /// The next message; waits for it. `None` once the lane is closed and nothing waits.
    ///
    /// Nothing is lost when the future is dropped before it is ready.
    pub async fn next(&self) -> Option<Bytes> {
        loop {
            {
                let mut state = self.lane.lock();
                let message = state.pop(self.id);
                if message.is_some() || state.closed {
                    return message;
                }
            }
            self.filled.notified().await;
        }
    }

    /// Starts over with the whole model: the viewer says that it does not match.
    pub fn resync(&self) {
        let mut state = self.lane.lock();
        if let Some(queue) = state.queues.get_mut(&self.id) {
            queue.chunks.clear();
            queue.epochs.clear();
            queue.epoch_bytes = 0;
            queue.lagged = true;
            queue.filled.notify_one();
        }
    }
}

impl Drop for ModelSubscription {
    fn drop(&mut self) {
        self.lane.lock().queues.remove(&self.id);
    }
}

/// The update as changes of what viewers hold, and how many surfels have no packed form.
///
/// Whether a surfel is added or updated is decided by what is held: a surfel that had no packed form yet, or has none
/// any more, is then neither forgotten nor left behind.
fn reconcile(held: &PackedModel, update: &ModelUpdate) -> Result<(ModelEpoch, usize), ProtocolError> {
    let packable = |surfel: &WireSurfel| SurfelRecord::pack(surfel).is_ok();
    let (packable, unpackable): (Vec<WireSurfel>, Vec<WireSurfel>) =
        update.changed.iter().copied().partition(packable);
    let (updated, added): (Vec<_>, Vec<_>) = packable.into_iter().partition(|surfel| held.holds(surfel.id));
    let is_changed = |id: u32| updated.binary_search_by_key(&id, |surfel| surfel.id).is_ok();
    let gone = update.removed.iter().copied().chain(unpackable.iter().map(|surfel| surfel.id));
    let mut removed: Vec<u32> = gone.filter(|&id| held.holds(id) && !is_changed(id)).collect();
    removed.sort_unstable();
    removed.dedup();
    let changes = ModelEpoch {
        epoch: held.epoch() + 1,
        base_epoch: held.epoch(),
        stamp_ns: update.stamp_ns,
        removed_ids: pack_ids(&removed),
        added: Some(pack_surfels(&added)?),
        updated: Some(pack_surfels(&updated)?),
        ..ModelEpoch::default()
    };
    Ok((changes, unpackable.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures_util::FutureExt;
    use protocol::SnapshotAssembly;

    fn surfel(id: u32, x_m: f32) -> WireSurfel {
        WireSurfel {
            id,
            position_in_world_m: [x_m, 0.0, 0.1],
            normal_in_world: [0.0, 0.0, -1.0],
            radius_m: 0.001,
            color: [180, 90, 80],
            confidence: 1.0,
        }
    }

    fn update(changed: &[u32], removed: &[u32]) -> ModelUpdate {
        let changed = changed.iter().map(|&id| surfel(id, id as f32 * 1e-3)).collect();
        ModelUpdate { stamp_ns: 1, changed, removed: removed.to_vec() }
    }

    /// A viewer's model after everything that waits for it.
    fn follow(subscription: &ModelSubscription, model: &mut PackedModel) -> usize {
        let mut assembly = SnapshotAssembly::default();
        let mut messages = 0;
        while let Some(Some(bytes)) = subscription.next().now_or_never() {
            messages += 1;
            match protocol::decode_from_server(bytes).unwrap().body.unwrap() {
                from_server::Body::Snapshot(chunk) => {
                    if let Some(seeded) = assembly.push(&chunk).unwrap() {
                        *model = seeded;
                    }
                }
                from_server::Body::Epoch(epoch) => model.apply(&epoch).unwrap(),
                other => panic!("{other:?} on the model lane"),
            }
        }
        messages
    }

    #[test]
    fn viewers_that_join_at_any_time_hold_the_same_model() {
        let lane = ModelLane::new(1 << 20);
        let early = lane.subscribe(Seed::Snapshot);
        lane.publish(&update(&[1, 2, 3], &[])).unwrap();
        let late = lane.subscribe(Seed::Snapshot);
        lane.publish(&update(&[2, 4], &[1])).unwrap();
        let (mut first, mut second) = (PackedModel::default(), PackedModel::default());
        follow(&early, &mut first);
        follow(&late, &mut second);
        assert_eq!(first.ids(), [2, 3, 4]);
        assert_eq!(first, second);
        assert_eq!(lane.extent(), (2, 3));
    }

    #[test]
    fn all_viewers_are_sent_the_same_bytes() {
        let lane = ModelLane::new(1 << 20);
        lane.publish(&update(&[1], &[])).unwrap();
        let [a, b] = [lane.subscribe(Seed::Snapshot), lane.subscribe(Seed::Snapshot)];
        let [a, b] = [a, b].map(|viewer| viewer.next().now_or_never().flatten().unwrap());
        assert_eq!(a.as_ptr(), b.as_ptr());
    }

    #[test]
    fn a_viewer_over_its_budget_is_seeded_anew_and_others_do_not_notice() {
        let lane = ModelLane::new(2000);
        let (slow, quick) = (lane.subscribe(Seed::Snapshot), lane.subscribe(Seed::Snapshot));
        let (mut slow_model, mut quick_model) = (PackedModel::default(), PackedModel::default());
        let mut quick_messages = 0;
        for _ in 0..20 {
            lane.publish(&update(&(0..20).collect::<Vec<_>>(), &[])).unwrap();
            quick_messages += follow(&quick, &mut quick_model);
        }
        assert_eq!(quick_messages, 21);
        assert!(follow(&slow, &mut slow_model) < 10);
        assert_eq!(slow_model, quick_model);
    }

    #[test]
    fn a_viewer_that_asks_is_seeded_anew() {
        let lane = ModelLane::new(1 << 20);
        lane.publish(&update(&[1, 2], &[])).unwrap();
        let viewer = lane.subscribe(Seed::Snapshot);
        follow(&viewer, &mut PackedModel::default());
        viewer.resync();
        let mut model = PackedModel::default();
        follow(&viewer, &mut model);
        assert_eq!(model.ids(), [1, 2]);
    }

    #[test]
    fn surfels_without_a_packed_form_are_left_out_until_they_have_one() {
        let lane = ModelLane::new(1 << 20);
        let far =
            |x_m| ModelUpdate { stamp_ns: 1, changed: vec![surfel(1, 0.0), surfel(2, x_m)], removed: vec![] };
        let sent = lane.publish(&far(f32::NAN)).unwrap();
        assert_eq!((sent.surfels, sent.unpackable), (1, 1));
        assert_eq!(lane.publish(&far(0.5)).unwrap().surfels, 2);
        assert_eq!(lane.publish(&far(99.0)).unwrap().surfels, 1);
        assert_eq!(lane.publish(&update(&[], &[2])).unwrap().surfels, 1);
    }

    #[test]
    fn a_cleared_model_is_empty_and_goes_on_from_the_same_epochs() {
        let lane = ModelLane::new(1 << 20);
        let viewer = lane.subscribe(Seed::Snapshot);
        lane.publish(&update(&[1, 2], &[])).unwrap();
        lane.clear().unwrap();
        lane.publish(&update(&[1], &[])).unwrap();
        let mut model = PackedModel::default();
        follow(&viewer, &mut model);
        assert_eq!((model.epoch(), model.ids()), (3, &[1][..]));
    }

    #[test]
    fn a_closed_lane_ends_after_what_waits() {
        let lane = ModelLane::new(1 << 20);
        let viewer = lane.subscribe(Seed::Nothing);
        lane.publish(&update(&[1], &[])).unwrap();
        lane.close();
        assert!(viewer.next().now_or_never().unwrap().is_some());
        assert_eq!(viewer.next().now_or_never().unwrap(), None);
    }
}
