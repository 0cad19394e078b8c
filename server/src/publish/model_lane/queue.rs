//! What waits for one viewer, and when it has lagged too far.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use protocol::v1::{ModelEpoch, from_server};
use protocol::{Bytes, EpochChanges, PackedModel, ProtocolError, pack_ids};
use tokio::sync::Notify;

use super::detail::{Detail, ViewerWishes};
use super::seed::{Prepared, SeedBase};
use super::{LagLimits, Seed};

/// A seed is as large as a viewer takes in this time at the rate seen.
const SEED_TIME: Duration = Duration::from_secs(1);
/// Bytes of a surfel in a snapshot, about.
const SEED_BYTES_PER_SURFEL: f64 = 14.0;
/// Never fewer surfels, however slow the viewer.
const SEED_SURFELS_MIN: usize = 500;
/// A thinned viewer that has kept up for this time gets more; doubles each time that it then lags.
const PATIENCE: Duration = Duration::from_secs(5);
const PATIENCE_MAX: Duration = Duration::from_secs(80);
const MORE: usize = 4;

/// An epoch, once for all viewers.
pub(super) struct EncodedEpoch {
    pub bytes: Bytes,
    pub epoch: ModelEpoch,
}

/// Where a queue stands; changed by [`Queue::enter`] alone.
#[derive(Debug, PartialEq, Eq)]
enum Phase {
    /// A snapshot is due.
    Unseeded,
    /// It is being packed; epochs since it are kept.
    Seeding,
    Following,
}

/// What comes next out of a queue.
pub(super) enum Next {
    /// A message.
    Message(Bytes),
    /// Nothing before this time.
    NotBefore(Instant),
    /// A snapshot has to be found and packed.
    NeedsSeed,
    /// Nothing for now.
    Empty,
}

/// One viewer's place in the lane.
pub(super) struct Queue {
    seed: Seed,
    phase: Phase,
    /// Numbers the seeds begun: one that was given up is not put in when it is packed.
    seeds_begun: u64,
    wishes: ViewerWishes,
    chunks: VecDeque<Bytes>,
    epochs: VecDeque<(Arc<EncodedEpoch>, Instant)>,
    epoch_bytes: usize,
    /// What a viewer holds that gets a part only.
    thin: Option<(PackedModel, Detail)>,
    /// Surfels that the viewer seems able to take.
    surfels_able: usize,
    sent_bytes: usize,
    seeded_at: Instant,
    lagged_at: Instant,
    patience: Duration,
    not_before: Instant,
    filled: Arc<Notify>,
}

impl Queue {
    pub fn new(seed: Seed, now: Instant) -> Self {
        Self {
            seed,
            phase: if seed == Seed::Nothing { Phase::Following } else { Phase::Unseeded },
            seeds_begun: 0,
            wishes: ViewerWishes::default(),
            chunks: VecDeque::new(),
            epochs: VecDeque::new(),
            epoch_bytes: 0,
            thin: None,
            surfels_able: usize::MAX,
            sent_bytes: 0,
            seeded_at: now,
            lagged_at: now,
            patience: PATIENCE,
            not_before: now,
            filled: Arc::new(Notify::new()),
        }
    }

    pub fn filled(&self) -> Arc<Notify> {
        Arc::clone(&self.filled)
    }

    pub fn wake(&self) {
        self.filled.notify_one();
    }

    pub fn waiting_bytes(&self) -> usize {
        self.epoch_bytes + self.chunks.iter().map(Bytes::len).sum::<usize>()
    }

    pub fn is_viewer(&self) -> bool {
        self.seed == Seed::Snapshot
    }

    /// Whether the snapshot must be of the present epoch.
    pub fn wants_no_tail(&self) -> bool {
        self.seed == Seed::Whole
    }

    pub fn wishes(&self) -> ViewerWishes {
        self.wishes
    }

    /// Surfels of the next seed.
    pub fn surfels_max(&self) -> usize {
        self.surfels_able.min(self.wishes.surfels_max.unwrap_or(usize::MAX))
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.wake();
    }

    /// Starts over with a snapshot.
    pub fn reseed(&mut self) {
        self.chunks.clear();
        self.forget_epochs();
        let phase = if self.seed == Seed::Nothing { Phase::Following } else { Phase::Unseeded };
        self.enter(phase);
    }

    /// Takes new wishes over; a viewer that may get more or must get less is seeded anew.
    pub fn set_wishes(&mut self, wishes: ViewerWishes) {
        let resized = wishes.surfels_max != self.wishes.surfels_max;
        let moved = self.thin.is_some() && wishes.gaze_in_world_m != self.wishes.gaze_in_world_m;
        self.wishes = wishes;
        if resized || moved {
            self.reseed();
        }
    }

    /// A snapshot has been found: `tail` are the epochs since. The number is for [`Self::finish_seed`].
    pub fn begin_seed(&mut self, tail: Vec<Arc<EncodedEpoch>>, now: Instant) -> u64 {
        self.forget_epochs();
        self.thin = None;
        self.epoch_bytes = tail.iter().map(|epoch| epoch.bytes.len()).sum();
        self.epochs = tail.into_iter().map(|epoch| (epoch, now)).collect();
        self.seeds_begun += 1;
        self.enter(Phase::Seeding);
        self.seeds_begun
    }

    /// The snapshot is packed.
    pub fn finish_seed(&mut self, number: u64, prepared: Prepared, now: Instant) {
        if self.phase == Phase::Seeding && number == self.seeds_begun {
            self.chunks = prepared.chunks.into();
            self.thin = prepared.thin;
            (self.sent_bytes, self.seeded_at) = (0, now);
            self.enter(Phase::Following);
        }
    }

    /// The next epoch comes in.
    pub fn push(&mut self, epoch: &Arc<EncodedEpoch>, limits: &LagLimits, now: Instant) {
        if self.phase == Phase::Unseeded {
            return;
        }
        self.epoch_bytes += epoch.bytes.len();
        self.epochs.push_back((Arc::clone(epoch), now));
        // A snapshot under way is finished first, so that a slow viewer sees some model rather than none.
        let oldest = self.epochs.front().filter(|_| self.chunks.is_empty()).map(|(_, since)| *since);
        let late = oldest.is_some_and(|since| now.duration_since(since) > limits.age);
        if self.epoch_bytes > limits.bytes || (late && self.phase == Phase::Following) {
            self.lag(now);
        } else if self.may_get_more(now) {
            self.surfels_able = self.surfels_able.saturating_mul(MORE);
            self.lagged_at = now;
            self.reseed();
        }
        self.wake();
    }

    /// Gives the queue up; the next seed is what the viewer can take in a second.
    fn lag(&mut self, now: Instant) {
        let seconds = now.duration_since(self.seeded_at).as_secs_f64().max(1e-3);
        let surfels = self.sent_bytes as f64 / seconds * SEED_TIME.as_secs_f64() / SEED_BYTES_PER_SURFEL;
        // Before its snapshot is packed nothing is known of what it can take.
        if self.phase == Phase::Following {
            self.surfels_able = (surfels as usize).max(SEED_SURFELS_MIN);
        }
        if self.thin.is_some() {
            self.patience = (2 * self.patience).min(PATIENCE_MAX);
        }
        self.lagged_at = now;
        // Chunks under way stay: see `push`.
        self.forget_epochs();
        if self.seed != Seed::Nothing {
            self.enter(Phase::Unseeded);
        }
    }

    fn may_get_more(&self, now: Instant) -> bool {
        let limited_by_rate = self.surfels_able < self.wishes.surfels_max.unwrap_or(usize::MAX);
        self.thin.is_some() && limited_by_rate && now.duration_since(self.lagged_at) > self.patience
    }

    fn forget_epochs(&mut self) {
        self.epochs.clear();
        self.epoch_bytes = 0;
    }

    /// Takes the next message out.
    ///
    /// # Errors
    /// [`ProtocolError`] where a thinned viewer's epoch does not fit what it holds, which cannot be; it is seeded anew.
    pub fn pop(&mut self, now: Instant) -> Result<Next, ProtocolError> {
        let nothing_waits =
            self.chunks.is_empty() && (self.phase == Phase::Seeding || self.epochs.is_empty());
        if nothing_waits {
            return Ok(if self.phase == Phase::Unseeded { Next::NeedsSeed } else { Next::Empty });
        }
        if now < self.not_before {
            return Ok(Next::NotBefore(self.not_before));
        }
        let message = match self.chunks.pop_front() {
            Some(chunk) => chunk,
            None => match self.pop_epoch()? {
                Some(epoch) => epoch,
                None => return Ok(Next::Empty),
            },
        };
        self.sent_bytes += message.len();
        if let Some(rate) = self.wishes.bytes_per_s_max {
            let pause = Duration::from_secs_f64(message.len() as f64 / f64::from(rate.max(1)));
            self.not_before = self.not_before.max(now) + pause;
        }
        Ok(Next::Message(message))
    }

    fn pop_epoch(&mut self) -> Result<Option<Bytes>, ProtocolError> {
        let Some((encoded, _)) = self.epochs.pop_front() else { return Ok(None) };
        self.epoch_bytes -= encoded.bytes.len();
        let Some((thin, detail)) = &mut self.thin else { return Ok(Some(encoded.bytes.clone())) };
        let part = part_of(&encoded.epoch, thin, detail)?;
        let epoch = thin.advance(part)?;
        Ok(Some(protocol::from_server_compressed(from_server::Body::Epoch(epoch))))
    }
}

/// The epoch as far as it concerns a viewer that holds `thin`.
fn part_of(epoch: &ModelEpoch, thin: &PackedModel, detail: &Detail) -> Result<ModelEpoch, ProtocolError> {
    let changes = EpochChanges::unpack(epoch, thin.nodes().len())?;
    let holds = |id: u32| thin.surfels().index_of(id).is_some();
    let removed: Vec<u32> = changes.removed.into_iter().filter(|&id| holds(id)).collect();
    let unpacked =
        |rows: Vec<(u32, protocol::SurfelRecord)>| rows.into_iter().map(|(id, row)| row.unpack(id));
    let updated: Vec<_> = unpacked(changes.updated).filter(|surfel| holds(surfel.id)).collect();
    let admitted = |surfel: &protocol::WireSurfel| detail.admits(surfel.id, surfel.position_in_world_m);
    let added: Vec<_> = unpacked(changes.added).filter(admitted).collect();
    Ok(ModelEpoch {
        removed_ids: pack_ids(&removed)?,
        updated: Some(protocol::pack_surfels(&updated)?),
        added: Some(protocol::pack_surfels(&added)?),
        ..epoch.clone()
    })
}

/// What a queue needs to be seeded.
pub(super) struct SeedOrder {
    pub number: u64,
    pub base: Arc<SeedBase>,
    pub wishes: ViewerWishes,
    pub surfels: usize,
    pub scope_in_world_m: Option<[f32; 3]>,
}
