//! Pairs that wait for the connection: a bounded while; then the oldest give way and are counted.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use protocol::v1::StereoPair;
use tokio::sync::Notify;

/// A queue of `capacity` pairs; who puts in never waits.
pub(crate) fn queue(capacity: usize) -> (QueueInlet, QueueOutlet) {
    let state = State { waiting: VecDeque::new(), ended: false };
    let shared =
        Arc::new(Shared { state: Mutex::new(state), changed: Notify::new(), capacity: capacity.max(1) });
    (QueueInlet { shared: Arc::clone(&shared) }, QueueOutlet { shared })
}

struct State {
    waiting: VecDeque<StereoPair>,
    ended: bool,
}

struct Shared {
    state: Mutex<State>,
    changed: Notify,
    capacity: usize,
}

impl Shared {
    /// The state is whole between any two statements, so a panic elsewhere does not spoil it.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The end that pairs are put in by; the queue ends when it is dropped.
pub(crate) struct QueueInlet {
    shared: Arc<Shared>,
}

impl QueueInlet {
    /// Puts a pair in; the oldest gives way where there is no room.
    pub fn put(&self, pair: StereoPair) {
        {
            let mut state = self.shared.state();
            if state.waiting.len() >= self.shared.capacity {
                state.waiting.pop_front();
            }
            state.waiting.push_back(pair);
        }
        self.shared.changed.notify_one();
    }
}

impl Drop for QueueInlet {
    fn drop(&mut self) {
        self.shared.state().ended = true;
        self.shared.changed.notify_one();
    }
}

/// The end that pairs are taken out by.
pub(crate) struct QueueOutlet {
    shared: Arc<Shared>,
}

impl QueueOutlet {
    /// The oldest pair; waits for one. `None` once all are through. Nothing is lost when the future is dropped.
    pub async fn take(&mut self) -> Option<StereoPair> {
        loop {
            {
                let mut state = self.shared.state();
                if let Some(pair) = state.waiting.pop_front() {
                    return Some(pair);
                }
                if state.ended {
                    return None;
                }
            }
            self.shared.changed.notified().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(sequence: u64) -> StereoPair {
        StereoPair { sequence, ..StereoPair::default() }
    }

    #[tokio::test]
    async fn the_oldest_pairs_give_way_and_the_rest_leave_in_order() {
        let (inlet, mut outlet) = queue(3);
        (0..5).for_each(|sequence| inlet.put(pair(sequence)));
        drop(inlet);
        let mut left = Vec::new();
        while let Some(pair) = outlet.take().await {
            left.push(pair.sequence);
        }
        assert_eq!(left, [2, 3, 4]);
    }

    #[tokio::test]
    async fn who_waits_is_woken_by_a_pair_and_by_the_end() {
        let (inlet, mut outlet) = queue(3);
        let waiting = tokio::spawn(async move { (outlet.take().await, outlet.take().await) });
        tokio::task::yield_now().await;
        inlet.put(pair(7));
        tokio::task::yield_now().await;
        drop(inlet);
        let (first, second) = waiting.await.unwrap();
        assert_eq!((first.map(|pair| pair.sequence), second.is_none()), (Some(7), true));
    }
}
