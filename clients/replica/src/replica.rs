//! The state machine of a replica: wait for a snapshot, take its chunks in, follow the epochs.

use std::collections::VecDeque;

use protocol::v1::{ModelEpoch, SnapshotChunk};
use protocol::{Digest, EpochChanges, NodeTable, ProtocolError, SurfelTable};

use crate::seeding::Seeding;
use crate::{ReplicaError, Surfel, Warp};

/// Bytes of epochs that are kept while a snapshot is under way.
const EARLY_EPOCHS_MAX_BYTES: usize = 8 << 20;

/// What a message did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing for now: an epoch of the past, or one kept until its snapshot is complete.
    Kept,
    /// A part of a snapshot is in.
    Seeding,
    /// The model is the server's at [`Replica::epoch`].
    Current,
}

/// Where a replica stands; changed by [`Replica::enter`] alone.
#[derive(Clone, Debug, Default)]
enum Phase {
    /// Nothing fits until a snapshot begins.
    #[default]
    Waiting,
    Seeding(Box<Seeding>),
    Following,
}

/// A model that is kept equal to the server's.
///
/// What does not fit is an error and leaves the replica waiting for a snapshot, with the last good model still held.
#[derive(Clone, Debug, Default)]
pub struct Replica {
    phase: Phase,
    epoch: u32,
    surfels: SurfelTable<Surfel>,
    nodes: NodeTable,
    node_reach_m: f32,
    early: VecDeque<ModelEpoch>,
    early_bytes: usize,
}

impl Replica {
    /// Of one who is there before the first epoch: the empty model needs no snapshot.
    pub fn from_the_start() -> Self {
        Self { phase: Phase::Following, ..Self::default() }
    }

    /// The epoch that the model was last equal to; 0 for none.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Whether it is equal to the server's model at [`Self::epoch`]; otherwise a snapshot is due.
    pub fn is_current(&self) -> bool {
        matches!(self.phase, Phase::Following)
    }

    /// Surfels held, by id.
    pub fn surfels(&self) -> &SurfelTable<Surfel> {
        &self.surfels
    }

    /// Deformation nodes held, by id.
    pub fn nodes(&self) -> &NodeTable {
        &self.nodes
    }

    /// Surfels of a snapshot under way, to be shown before it is complete.
    pub fn arriving(&self) -> impl Iterator<Item = &Surfel> {
        match &self.phase {
            Phase::Seeding(seeding) => Some(seeding.surfels()),
            Phase::Waiting | Phase::Following => None,
        }
        .into_iter()
        .flatten()
    }

    /// Digest over surfels and nodes.
    pub fn digest(&self) -> Digest {
        self.surfels.digest().joined(self.nodes.digest())
    }

    /// Starts over with the next snapshot: after a new connection.
    pub fn forget(&mut self) {
        self.enter(Phase::Waiting);
        self.forget_early();
    }

    /// Takes a part of a snapshot in.
    ///
    /// # Errors
    /// Malformed arrays, ids that come twice, another digest.
    pub fn take_chunk(&mut self, chunk: &SnapshotChunk) -> Result<Progress, ReplicaError> {
        self.or_wait(|replica| replica.seed(chunk))
    }

    /// Takes an epoch in.
    ///
    /// # Errors
    /// An epoch on another base, malformed arrays, ids that should be held and are not or the other way round, another
    /// digest, too many epochs before a snapshot.
    pub fn take_epoch(&mut self, epoch: &ModelEpoch) -> Result<Progress, ReplicaError> {
        self.or_wait(|replica| match replica.phase {
            Phase::Following => replica.follow(epoch),
            Phase::Waiting | Phase::Seeding(_) => replica.keep_for_later(epoch),
        })
    }

    fn or_wait(
        &mut self,
        act: impl FnOnce(&mut Self) -> Result<Progress, ReplicaError>,
    ) -> Result<Progress, ReplicaError> {
        let done = act(self);
        if done.is_err() {
            self.enter(Phase::Waiting);
        }
        done
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
    }

    fn seed(&mut self, chunk: &SnapshotChunk) -> Result<Progress, ReplicaError> {
        let mut seeding = match std::mem::take(&mut self.phase) {
            Phase::Seeding(seeding) if seeding.is_of(chunk) => seeding,
            _ => Box::new(Seeding::new(chunk)),
        };
        if !seeding.take(chunk)? {
            self.enter(Phase::Seeding(seeding));
            return Ok(Progress::Seeding);
        }
        let (epoch, digest, node_reach_m) = (seeding.epoch, seeding.digest, seeding.node_reach_m);
        let (surfels, nodes) = seeding.complete()?;
        expect_digest(epoch, surfels.digest().joined(nodes.digest()), digest)?;
        (self.surfels, self.nodes, self.epoch, self.node_reach_m) = (surfels, nodes, epoch, node_reach_m);
        self.enter(Phase::Following);
        self.catch_up()
    }

    /// Applies what came while the snapshot was under way.
    fn catch_up(&mut self) -> Result<Progress, ReplicaError> {
        while let Some(epoch) = self.early.pop_front() {
            if epoch.epoch > self.epoch {
                self.follow(&epoch)?;
            }
        }
        self.early_bytes = 0;
        Ok(Progress::Current)
    }

    fn keep_for_later(&mut self, epoch: &ModelEpoch) -> Result<Progress, ReplicaError> {
        if self.early.back().is_some_and(|last| last.epoch != epoch.base_epoch) {
            self.forget_early();
        }
        let arrays = [&epoch.node_transforms, &epoch.removed_ids];
        let blocks = [&epoch.added, &epoch.updated].into_iter().flatten();
        self.early_bytes += arrays.iter().map(|array| array.len()).sum::<usize>();
        self.early_bytes += blocks.map(|block| block.ids.len() + block.records.len()).sum::<usize>();
        if self.early_bytes > EARLY_EPOCHS_MAX_BYTES {
            let error = ReplicaError::Overrun { bytes: self.early_bytes, limit: EARLY_EPOCHS_MAX_BYTES };
            self.forget_early();
            return Err(error);
        }
        self.early.push_back(epoch.clone());
        Ok(Progress::Kept)
    }

    fn forget_early(&mut self) {
        self.early.clear();
        self.early_bytes = 0;
    }

    /// Checks everything before it changes anything.
    fn follow(&mut self, epoch: &ModelEpoch) -> Result<Progress, ReplicaError> {
        if epoch.epoch <= self.epoch {
            return Ok(Progress::Kept);
        }
        if epoch.base_epoch != self.epoch {
            return Err(ProtocolError::WrongBase { held: self.epoch, base: epoch.base_epoch }.into());
        }
        let changes = EpochChanges::unpack(epoch, self.nodes.len())?;
        let nodes = changes.nodes_after(&self.nodes)?;
        let surfels = self.surfels.digest_after(epoch.epoch, &changes.surfels())?;
        expect_digest(epoch.epoch, surfels.joined(nodes.digest()), epoch.digest)?;
        if !changes.transforms.is_empty() {
            let warp = Warp::new(&self.nodes, self.node_reach_m, &changes.transforms);
            warp.apply(self.surfels.rows_mut());
        }
        self.surfels.apply(epoch.epoch, &changes.surfels(), |record| record.into());
        (self.nodes, self.epoch, self.node_reach_m) = (nodes, epoch.epoch, epoch.node_reach_m);
        Ok(Progress::Current)
    }
}

fn expect_digest(epoch: u32, got: Digest, expected: u32) -> Result<(), ReplicaError> {
    if got.value() == expected {
        Ok(())
    } else {
        Err(ReplicaError::Digest { epoch, got: got.value(), expected })
    }
}
