//! The hand-over between stages: live video keeps the newest, a replay loses nothing (design section 4).

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What happens to a value offered to a full mailbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// The oldest waiting value is dropped and counted: the paper's rule for live video.
    NewestWins,
    /// The sender waits: back-pressure for replays.
    Lossless,
}

/// What became of an offered value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// It waits for the receiver.
    Queued,
    /// It waits for the receiver, in the place of an older one that is lost.
    Superseded,
    /// The receiver is gone; the value is lost.
    Closed,
}

/// What a receiver finds within a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken<T> {
    /// The oldest waiting value.
    Value(T),
    /// Nothing came in time.
    Nothing,
    /// Nothing came yet, but a [`MailboxWaker`] called.
    Woken,
    /// Nothing waits and no sender is left.
    Closed,
}

/// A bounded mailbox of `capacity` values.
pub fn mailbox<T>(policy: Policy, capacity: usize) -> (MailboxSender<T>, MailboxReceiver<T>) {
    let shared = Arc::new(Shared {
        state: Mutex::new(State {
            waiting: VecDeque::with_capacity(capacity),
            senders: 1,
            receiving: true,
            wakes: 0,
        }),
        changed: Condvar::new(),
        policy,
        capacity: capacity.max(1),
    });
    (MailboxSender { shared: Arc::clone(&shared) }, MailboxReceiver { shared })
}

struct State<T> {
    waiting: VecDeque<T>,
    senders: usize,
    receiving: bool,
    /// Calls of wakers that the receiver has not been told.
    wakes: usize,
}

struct Shared<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    policy: Policy,
    capacity: usize,
}

impl<T> Shared<T> {
    /// The state is consistent between any two statements, so a panic elsewhere does not spoil it.
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The end that values are put in by; clones share the mailbox.
pub struct MailboxSender<T> {
    shared: Arc<Shared<T>>,
}

impl<T> MailboxSender<T> {
    /// Puts a value in by the mailbox's own policy.
    pub fn offer(&self, value: T) -> Offer {
        self.offer_by(self.shared.policy, value)
    }

    /// Puts a value in; waits for room only under [`Policy::Lossless`].
    pub fn offer_by(&self, policy: Policy, value: T) -> Offer {
        let mut state = self.shared.lock();
        let mut offer = Offer::Queued;
        while state.receiving && state.waiting.len() >= self.shared.capacity {
            match policy {
                Policy::NewestWins => {
                    state.waiting.pop_front();
                    offer = Offer::Superseded;
                }
                Policy::Lossless => {
                    state = self.shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                }
            }
        }
        if !state.receiving {
            return Offer::Closed;
        }
        state.waiting.push_back(value);
        self.shared.changed.notify_all();
        offer
    }
}

impl<T> Clone for MailboxSender<T> {
    fn clone(&self) -> Self {
        self.shared.lock().senders += 1;
        Self { shared: Arc::clone(&self.shared) }
    }
}

impl<T> Drop for MailboxSender<T> {
    fn drop(&mut self) {
        self.shared.lock().senders -= 1;
        self.shared.changed.notify_all();
    }
}

/// The end that values are taken out by.
pub struct MailboxReceiver<T> {
    shared: Arc<Shared<T>>,
}

impl<T> MailboxReceiver<T> {
    /// The oldest waiting value; waits for one. `None` once all senders are gone and nothing waits.
    pub fn take(&self) -> Option<T> {
        loop {
            match self.take_within(Duration::MAX) {
                Taken::Value(value) => return Some(value),
                Taken::Nothing | Taken::Woken => {}
                Taken::Closed => return None,
            }
        }
    }

    /// The oldest waiting value; waits for one at most this long.
    pub fn take_within(&self, patience: Duration) -> Taken<T> {
        let started = Instant::now();
        let mut state = self.shared.lock();
        loop {
            if let Some(value) = state.waiting.pop_front() {
                self.shared.changed.notify_all();
                return Taken::Value(value);
            }
            if state.senders == 0 {
                return Taken::Closed;
            }
            if state.wakes > 0 {
                state.wakes -= 1;
                return Taken::Woken;
            }
            let Some(left) = patience.checked_sub(started.elapsed()) else { return Taken::Nothing };
            let waited = self.shared.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl<T> MailboxReceiver<T> {
    /// For those who want the receiver to look at something else between values.
    pub fn waker(&self) -> MailboxWaker<T> {
        MailboxWaker { shared: Arc::clone(&self.shared) }
    }
}

/// Interrupts a receiver that waits; no sender, so it keeps no mailbox open.
pub struct MailboxWaker<T> {
    shared: Arc<Shared<T>>,
}

impl<T> MailboxWaker<T> {
    /// The receiver is told once per call, after the values that wait.
    pub fn wake(&self) {
        self.shared.lock().wakes += 1;
        self.shared.changed.notify_all();
    }
}

impl<T> Drop for MailboxReceiver<T> {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.receiving = false;
        state.waiting.clear();
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_live_mailbox_keeps_the_newest_and_says_what_it_dropped() {
        let (sender, receiver) = mailbox(Policy::NewestWins, 1);
        assert_eq!(sender.offer(1), Offer::Queued);
        assert_eq!(sender.offer(2), Offer::Superseded);
        assert_eq!(receiver.take(), Some(2));
    }

    #[test]
    fn a_lossless_mailbox_delivers_everything_in_order_to_a_slow_receiver() {
        let (sender, receiver) = mailbox(Policy::Lossless, 2);
        let producer =
            std::thread::spawn(move || (0..100).for_each(|n| assert_eq!(sender.offer(n), Offer::Queued)));
        let received: Vec<i32> = std::iter::from_fn(|| receiver.take()).collect();
        producer.join().unwrap();
        assert_eq!(received, (0..100).collect::<Vec<_>>());
    }

    #[test]
    fn what_waits_is_still_delivered_after_the_last_sender_left() {
        let (sender, receiver) = mailbox(Policy::NewestWins, 1);
        let clone = sender.clone();
        drop(sender);
        clone.offer(7);
        drop(clone);
        assert_eq!(receiver.take(), Some(7));
        assert_eq!(receiver.take(), None);
    }

    #[test]
    fn a_receiver_can_give_up_waiting() {
        let (sender, receiver) = mailbox(Policy::NewestWins, 1);
        assert_eq!(receiver.take_within(Duration::from_millis(1)), Taken::Nothing);
        sender.offer(3);
        assert_eq!(receiver.take_within(Duration::ZERO), Taken::Value(3));
        drop(sender);
        assert_eq!(receiver.take_within(Duration::from_secs(60)), Taken::Closed);
    }

    #[test]
    fn a_waker_is_heard_once_per_call_and_keeps_no_mailbox_open() {
        let (sender, receiver) = mailbox(Policy::NewestWins, 1);
        let waker = receiver.waker();
        waker.wake();
        waker.wake();
        sender.offer(1);
        let heard = [(); 4].map(|()| receiver.take_within(Duration::from_millis(1)));
        assert_eq!(heard, [Taken::Value(1), Taken::Woken, Taken::Woken, Taken::Nothing]);
        drop(sender);
        waker.wake();
        assert_eq!(receiver.take_within(Duration::from_secs(60)), Taken::Closed);
    }

    #[test]
    fn a_value_that_must_not_be_lost_waits_in_a_mailbox_of_newest_wins() {
        let (sender, receiver) = mailbox(Policy::NewestWins, 1);
        sender.offer(1);
        let patient = std::thread::spawn(move || sender.offer_by(Policy::Lossless, 2));
        assert_eq!((receiver.take(), receiver.take()), (Some(1), Some(2)));
        assert_eq!(patient.join().unwrap(), Offer::Queued);
    }

    #[test]
    fn a_waiting_sender_is_released_when_the_receiver_leaves() {
        let (sender, receiver) = mailbox(Policy::Lossless, 1);
        sender.offer(1);
        let blocked = std::thread::spawn(move || sender.offer(2));
        drop(receiver);
        assert_eq!(blocked.join().unwrap(), Offer::Closed);
    }
}
