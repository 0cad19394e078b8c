//! One GPU for all sessions, fairly: deficit round robin (Shreedhar, Varghese 1995) by measured GPU time.
//!
//! Sessions that wait stand in a ring. A visit adds a quantum to the session's credit; while that is positive the
//! session gets the GPU, and what its work took is taken off. The cost of a frame is known only afterwards, so credit
//! may go below zero: who took long is passed over until the others had as much. Nobody saves credit up.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The ring of sessions that share the GPU.
#[derive(Debug)]
pub struct GpuTurns {
    quantum_us: i64,
    ring: Mutex<Ring>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Ring {
    seats: VecDeque<SeatState>,
    next_number: u64,
    /// Who has the GPU, or may take it next.
    granted: Option<u64>,
}

#[derive(Debug)]
struct SeatState {
    number: u64,
    waiting: bool,
    credit_us: i64,
}

impl GpuTurns {
    /// An empty ring.
    pub fn new(quantum: Duration) -> Arc<Self> {
        let quantum_us = i64::try_from(quantum.as_micros()).unwrap_or(i64::MAX).max(1);
        Arc::new(Self { quantum_us, ring: Mutex::default(), changed: Condvar::new() })
    }

    /// The ring is consistent between any two statements, so a panic elsewhere does not spoil it.
    fn ring(&self) -> MutexGuard<'_, Ring> {
        self.ring.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A seat for one session.
    pub fn seat(self: &Arc<Self>) -> Seat {
        let mut ring = self.ring();
        let number = ring.next_number;
        ring.next_number += 1;
        ring.seats.push_back(SeatState { number, waiting: false, credit_us: 0 });
        Seat { turns: Arc::clone(self), number }
    }
}

impl Ring {
    fn seat(&mut self, number: u64) -> Option<&mut SeatState> {
        self.seats.iter_mut().find(|seat| seat.number == number)
    }

    /// Grants the GPU where it is free and somebody waits.
    fn grant(&mut self, quantum_us: i64) {
        if self.granted.is_some() || !self.seats.iter().any(|seat| seat.waiting) {
            return;
        }
        // Ends: each round adds a quantum to somebody who waits.
        while let Some(front) = self.seats.front_mut() {
            if front.waiting && front.credit_us > 0 {
                self.granted = Some(front.number);
                return;
            }
            if !front.waiting {
                front.credit_us = front.credit_us.min(0);
            }
            self.seats.rotate_left(1);
            if let Some(next) = self.seats.front_mut().filter(|next| next.waiting) {
                next.credit_us = next.credit_us.saturating_add(quantum_us);
            }
        }
    }
}

/// A session's place in the ring; given up when dropped.
#[derive(Debug)]
pub struct Seat {
    turns: Arc<GpuTurns>,
    number: u64,
}

impl Seat {
    /// Waits for the GPU.
    pub fn take(&self) -> Turn<'_> {
        let mut ring = self.turns.ring();
        if let Some(seat) = ring.seat(self.number) {
            seat.waiting = true;
        }
        ring.grant(self.turns.quantum_us);
        self.turns.changed.notify_all();
        while ring.granted != Some(self.number) {
            ring = self.turns.changed.wait(ring).unwrap_or_else(PoisonError::into_inner);
        }
        if let Some(seat) = ring.seat(self.number) {
            seat.waiting = false;
        }
        Turn { seat: self, started: Instant::now(), measured: None }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.turns.ring().seats.retain(|seat| seat.number != self.number);
    }
}

/// The GPU is this session's until this is dropped.
#[derive(Debug)]
pub struct Turn<'a> {
    seat: &'a Seat,
    started: Instant,
    measured: Option<Duration>,
}

impl Turn<'_> {
    /// What the GPU's own clock says of the work; without it the turn's wall time counts.
    pub fn measured(&mut self, used: Duration) {
        self.measured = Some(used);
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        let used = self.measured.unwrap_or_else(|| self.started.elapsed());
        let turns = &self.seat.turns;
        let mut ring = turns.ring();
        ring.granted = None;
        if let Some(seat) = ring.seat(self.seat.number) {
            seat.credit_us =
                seat.credit_us.saturating_sub(i64::try_from(used.as_micros()).unwrap_or(i64::MAX));
        }
        ring.grant(turns.quantum_us);
        turns.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sessions that always want the GPU, for `turns` turns in all; GPU time used by each. The costs are told, not
    /// spent, so that nothing depends on the clock.
    fn used_by_each(costs_ms: &[u64], turns_in_all: usize) -> Vec<Duration> {
        let mut ring = Ring::default();
        for number in 0..costs_ms.len() as u64 {
            ring.seats.push_back(SeatState { number, waiting: true, credit_us: 0 });
        }
        let mut used = vec![Duration::ZERO; costs_ms.len()];
        for _ in 0..turns_in_all {
            ring.grant(10_000);
            let number = ring.granted.take().expect("somebody waits");
            let cost = Duration::from_millis(costs_ms[number as usize]);
            let seat = ring.seat(number).expect("it is there");
            seat.credit_us -= cost.as_micros() as i64;
            used[number as usize] += cost;
        }
        used
    }

    #[test]
    fn sessions_of_unlike_cost_get_the_same_gpu_time() {
        let used = used_by_each(&[2, 7, 45], 3000);
        let (least, most) = (used.iter().min().unwrap(), used.iter().max().unwrap());
        assert!(*most - *least <= Duration::from_millis(2 * 45), "{used:?}");
    }

    #[test]
    fn a_session_alone_waits_for_nobody() {
        let turns = GpuTurns::new(Duration::from_millis(10));
        let (seat, _idle) = (turns.seat(), turns.seat());
        for _ in 0..50 {
            seat.take().measured(Duration::from_secs(60));
        }
        assert_eq!(turns.ring().granted, None);
    }

    #[test]
    fn who_waited_comes_before_who_took_long_and_nobody_is_forgotten() {
        let turns = GpuTurns::new(Duration::from_millis(10));
        let (greedy, modest) = (turns.seat(), turns.seat());
        let mut first = greedy.take();
        first.measured(Duration::from_secs(1));
        let waiting = std::thread::spawn(move || drop(modest.take()));
        while !turns.ring().seats.iter().any(|seat| seat.waiting) {
            std::thread::yield_now();
        }
        drop(first);
        waiting.join().unwrap();
        drop(greedy.take());
    }

    #[test]
    fn a_seat_given_up_holds_nobody_up() {
        let turns = GpuTurns::new(Duration::from_millis(10));
        let (one, other) = (turns.seat(), turns.seat());
        drop(one.take());
        drop(one);
        drop(other.take());
        assert_eq!(turns.ring().seats.len(), 1);
    }
}
