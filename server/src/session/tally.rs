//! Counts and rates of a session.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use protocol::v1::{Reason, ReasonCount};

const RATE_WINDOW: Duration = Duration::from_secs(2);
/// Enough for 120 Hz over the window.
const RATE_EVENTS_MAX: usize = 256;

/// Pairs dropped, by reason; every drop ends here.
#[derive(Debug, Default)]
pub struct Drops(BTreeMap<i32, u64>);

impl Drops {
    /// One more.
    pub fn count(&mut self, reason: Reason) {
        *self.0.entry(reason.into()).or_default() += 1;
    }

    /// On the wire.
    pub fn to_wire(&self) -> Vec<ReasonCount> {
        self.0.iter().map(|(&reason, &count)| ReasonCount { reason, count }).collect()
    }
}

/// Events counted for good, and their rate over the last seconds.
#[derive(Debug, Default)]
pub struct Meter {
    total: u64,
    recent: VecDeque<Instant>,
}

impl Meter {
    /// One more.
    pub fn count(&mut self, now: Instant) {
        self.total += 1;
        self.recent.push_back(now);
        if self.recent.len() > RATE_EVENTS_MAX {
            self.recent.pop_front();
        }
    }

    /// Since the start.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Over the last two seconds.
    pub fn rate_hz(&self, now: Instant) -> f32 {
        let recent = self.recent.iter().filter(|at| now.duration_since(**at) < RATE_WINDOW).count();
        recent as f32 / RATE_WINDOW.as_secs_f32()
    }
}

/// When the last pairs arrived, by their stamps: for latency and age.
#[derive(Debug, Default)]
pub struct Arrivals(VecDeque<(u64, Instant)>);

impl Arrivals {
    /// More than the pairs that can be under way between arrival and model.
    const CAPACITY: usize = 64;

    /// A pair was taken.
    pub fn note(&mut self, stamp_ns: u64, now: Instant) {
        self.0.push_back((stamp_ns, now));
        if self.0.len() > Self::CAPACITY {
            self.0.pop_front();
        }
    }

    /// When the pair with this stamp came, if it is not long ago.
    pub fn of(&self, stamp_ns: u64) -> Option<Instant> {
        self.0.iter().rev().find(|(stamp, _)| *stamp == stamp_ns).map(|(_, at)| *at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_that_of_the_last_two_seconds() {
        let start = Instant::now();
        let mut meter = Meter::default();
        for n in 0..60 {
            meter.count(start + Duration::from_millis(n * 100));
        }
        assert_eq!(meter.total(), 60);
        assert!((meter.rate_hz(start + Duration::from_millis(5950)) - 10.0).abs() < 0.6);
        assert_eq!(meter.rate_hz(start + Duration::from_secs(60)), 0.0);
    }

    #[test]
    fn drops_are_counted_by_reason() {
        let mut drops = Drops::default();
        drops.count(Reason::StaleStamp);
        drops.count(Reason::Unpaired);
        drops.count(Reason::StaleStamp);
        let wire = drops.to_wire();
        assert_eq!(wire.iter().map(|drop| drop.count).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(wire[1].reason(), Reason::StaleStamp);
    }
}
