//! What a cart tells about its stream.

use std::collections::{BTreeMap, VecDeque};
use std::time::Instant;

use protocol::v1::{Pose, Reason};

/// Pairs under way whose sending time is remembered.
const UNDER_WAY_MAX: usize = 512;
/// Latencies kept for the statistics, about an hour at 30 Hz.
const LATENCIES_MAX: usize = 100_000;

/// Where the stream is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// The session that it feeds.
    pub session: String,
    /// Pairs sent.
    pub sent: u64,
    /// Pairs of one pass through the recording, where it tells.
    pub expected: Option<u64>,
    /// Poses received.
    pub poses: u64,
    /// From sending to the pose, of the last one.
    pub latency_ms: f32,
}

/// How long poses took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latency {
    /// Half of them were quicker.
    pub median_ms: f32,
    /// 95 % of them were quicker.
    pub p95_ms: f32,
    /// The slowest.
    pub max_ms: f32,
}

/// What became of the stream.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishReport {
    /// The session that it fed.
    pub session: String,
    /// Pairs sent.
    pub sent: u64,
    /// Pairs skipped, as the connection was slow or away when they were due.
    pub skipped: u64,
    /// Poses received; the server sends the newest, so not every pair has one.
    pub poses: u64,
    /// From sending to pose; none without poses.
    pub latency: Option<Latency>,
    /// Pairs that the server refused, by reason.
    pub refused: BTreeMap<String, u64>,
    /// Times that the connection was lost and found again.
    pub reconnects: u64,
}

/// Counts as the stream goes.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub session: String,
    expected: Option<u64>,
    pub reconnects: u64,
    sent: u64,
    skipped: u64,
    poses: u64,
    refused: BTreeMap<String, u64>,
    next_sequence: u64,
    under_way: VecDeque<(u64, Instant)>,
    latencies_ms: VecDeque<f32>,
}

impl Tally {
    /// Nothing sent yet, of so many pairs.
    pub fn new(expected: Option<u64>) -> Self {
        Self { expected, ..Self::default() }
    }

    /// A pair leaves; those between it and the last one were skipped.
    pub fn note_sent(&mut self, sequence: u64, now: Instant) {
        self.sent += 1;
        self.skipped += sequence.saturating_sub(self.next_sequence);
        self.next_sequence = sequence + 1;
        push_bounded(&mut self.under_way, (sequence, now), UNDER_WAY_MAX);
    }

    /// A pose came.
    pub fn note_pose(&mut self, pose: &Pose, now: Instant) {
        self.poses += 1;
        while let Some((sequence, sent_at)) = self.under_way.front().copied() {
            if sequence > pose.sequence {
                break;
            }
            self.under_way.pop_front();
            if sequence == pose.sequence {
                let latency_ms = now.duration_since(sent_at).as_secs_f32() * 1e3;
                push_bounded(&mut self.latencies_ms, latency_ms, LATENCIES_MAX);
            }
        }
    }

    /// The server refused a pair.
    pub fn note_refused(&mut self, reason: Reason) {
        *self.refused.entry(reason.name()).or_default() += 1;
    }

    /// Whether any pair has left.
    pub fn has_sent(&self) -> bool {
        self.sent > 0
    }

    /// Whether poses are still to come.
    pub fn awaits_poses(&self) -> bool {
        !self.under_way.is_empty()
    }

    pub fn progress(&self) -> Progress {
        Progress {
            session: self.session.clone(),
            sent: self.sent,
            expected: self.expected,
            poses: self.poses,
            latency_ms: self.latencies_ms.back().copied().unwrap_or_default(),
        }
    }

    pub fn report(self) -> PublishReport {
        let latency = latency(self.latencies_ms.into());
        PublishReport {
            session: self.session,
            sent: self.sent,
            skipped: self.skipped,
            poses: self.poses,
            latency,
            refused: self.refused,
            reconnects: self.reconnects,
        }
    }
}

fn latency(mut latencies_ms: Vec<f32>) -> Option<Latency> {
    latencies_ms.sort_by(f32::total_cmp);
    let max_ms = *latencies_ms.last()?;
    let at = |share: f64| latencies_ms[((latencies_ms.len() - 1) as f64 * share).round() as usize];
    Some(Latency { median_ms: at(0.5), p95_ms: at(0.95), max_ms })
}

fn push_bounded<T>(queue: &mut VecDeque<T>, value: T, capacity: usize) {
    if queue.len() >= capacity {
        queue.pop_front();
    }
    queue.push_back(value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn latencies_skips_and_refusals_are_told() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut tally = Tally::default();
        for (sequence, ms) in [(0, 0), (1, 10), (4, 40)] {
            tally.note_sent(sequence, at(ms));
        }
        tally.note_pose(&Pose { sequence: 1, ..Pose::default() }, at(30));
        assert!(tally.awaits_poses());
        tally.note_pose(&Pose { sequence: 4, ..Pose::default() }, at(50));
        assert!(!tally.awaits_poses());
        tally.note_refused(Reason::MalformedImage);
        let report = tally.report();
        assert_eq!((report.sent, report.skipped, report.poses), (3, 2, 2));
        assert_eq!(report.refused["malformed_image"], 1);
        let latency = report.latency.unwrap();
        assert!((latency.max_ms - 20.0).abs() < 0.1, "{latency:?}");
    }
}
