//! A viewer's end of the lane.

use std::sync::Arc;
use std::time::Instant;

use protocol::Bytes;
use tokio::sync::Notify;

use super::queue::{Next, SeedOrder};
use super::{ModelLane, State, ViewerWishes};

/// How a subscription starts, and goes on after it lagged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seed {
    /// With the whole model.
    Snapshot,
    /// With the whole model at the present epoch, to be joined to epochs that come on another way.
    Whole,
    /// With the next epoch; the receiver finds the gap by the base epoch and asks for the model itself.
    Nothing,
}

/// One viewer's place in the lane; leaves it when dropped.
pub struct ModelSubscription {
    lane: ModelLane,
    id: u64,
    filled: Arc<Notify>,
}

/// What a subscription is to do next.
enum Step {
    Send(Bytes),
    Pack(SeedOrder),
    WaitUntil(Instant),
    Wait,
    End,
}

impl ModelSubscription {
    pub(super) fn new(lane: ModelLane, id: u64, filled: Arc<Notify>) -> Self {
        Self { lane, id, filled }
    }

    /// The next message; waits for it. `None` once the lane is closed and nothing waits.
    ///
    /// Nothing is lost when the future is dropped before it is ready.
    pub async fn next(&self) -> Option<Bytes> {
        loop {
            let step = self.lane.lock().step(self.id);
            match step {
                Step::Send(bytes) => return Some(bytes),
                Step::End => return None,
                Step::Pack(order) => self.pack(order),
                Step::WaitUntil(time) => tokio::time::sleep_until(time.into()).await,
                Step::Wait => self.filled.notified().await,
            }
        }
    }

    /// The chunks of the whole model; `None` where the lane is closed first.
    pub async fn whole(&self) -> Option<Vec<Bytes>> {
        let mut chunks = vec![self.next().await?];
        while let Step::Send(bytes) = self.lane.lock().step(self.id) {
            chunks.push(bytes);
        }
        Some(chunks)
    }

    /// Packs a snapshot beside the runtime's own threads; the queue then has it.
    fn pack(&self, order: SeedOrder) {
        let (lane, id) = (self.lane.clone(), self.id);
        tokio::task::spawn_blocking(move || {
            let prepared = order.base.prepare(&order.wishes, order.surfels, order.scope_in_world_m);
            let mut state = lane.lock();
            let Some(queue) = state.queues.get_mut(&id) else { return };
            match prepared {
                Ok(prepared) => queue.finish_seed(order.number, prepared, Instant::now()),
                Err(error) => {
                    tracing::error!(%error, "a snapshot could not be packed");
                    queue.reseed();
                    state.base = None;
                }
            }
        });
    }

    /// Starts over with the whole model: the viewer says that it does not match.
    pub fn resync(&self) {
        if let Some(queue) = self.lane.lock().queues.get_mut(&self.id) {
            queue.reseed();
        }
    }

    /// What the viewer looks at and can take.
    pub fn set_wishes(&self, wishes: ViewerWishes) {
        if let Some(queue) = self.lane.lock().queues.get_mut(&self.id) {
            queue.set_wishes(wishes);
        }
    }
}

impl Drop for ModelSubscription {
    fn drop(&mut self) {
        self.lane.lock().queues.remove(&self.id);
    }
}

impl State {
    fn step(&mut self, id: u64) -> Step {
        let now = Instant::now();
        let scope_in_world_m = self.scope_in_world_m;
        let Some(queue) = self.queues.get_mut(&id) else { return Step::End };
        let idle = if self.closed { Step::End } else { Step::Wait };
        match queue.pop(now) {
            Ok(Next::Message(bytes)) => Step::Send(bytes),
            Ok(Next::NotBefore(time)) => Step::WaitUntil(time),
            Ok(Next::Empty) => idle,
            Ok(Next::NeedsSeed) if self.closed => Step::End,
            Ok(Next::NeedsSeed) => {
                let without_tail = queue.wants_no_tail();
                let Some((base, tail)) = self.seed(without_tail) else { return idle };
                let Some(queue) = self.queues.get_mut(&id) else { return Step::End };
                let number = queue.begin_seed(tail, now);
                let surfels = queue.surfels_max().min(base.surfels());
                Step::Pack(SeedOrder { number, base, wishes: queue.wishes(), surfels, scope_in_world_m })
            }
            Err(error) => {
                tracing::error!(%error, "an epoch could not be thinned");
                queue.reseed();
                Step::Wait
            }
        }
    }
}
