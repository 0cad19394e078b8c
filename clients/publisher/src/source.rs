//! The recording's pairs at the pace of their stamps.

use std::thread;
use std::time::Duration;

use protocol::v1::StereoPair;
use recording::{RecordingError, RecordingReader};
use tokio::sync::mpsc;
use tokio::time::Instant;

use crate::convert::{self, Encoding};
use crate::queue::QueueInlet;

/// Pairs that are read ahead.
const READ_AHEAD_PAIRS: usize = 4;
/// Between the last pair of a pass and the first one of the next, where no interval can be told: 30 Hz.
const USUAL_INTERVAL_NS: u64 = 33_333_333;

/// Pairs in the order of their stamps, read on a thread of its own; ends with the recording, or never if `repeat`.
pub fn read(
    reader: RecordingReader,
    form: ((u32, u32), Encoding),
    repeat: bool,
) -> mpsc::Receiver<Result<StereoPair, RecordingError>> {
    let (pairs, receiver) = mpsc::channel(READ_AHEAD_PAIRS);
    thread::spawn(move || {
        let mut pass = Pass { reader, form, pairs, stamps: Stamps::default(), sequence: 0 };
        loop {
            match pass.run() {
                Ok(true) if repeat => pass.stamps.start_over(),
                Ok(_) => return,
                // The receiver may be gone, and with it the interest.
                Err(error) => return drop(pass.pairs.blocking_send(Err(error))),
            }
        }
    });
    receiver
}

/// One way through the recording after the other.
struct Pass {
    reader: RecordingReader,
    /// Size and encoding of the images.
    form: ((u32, u32), Encoding),
    pairs: mpsc::Sender<Result<StereoPair, RecordingError>>,
    stamps: Stamps,
    sequence: u64,
}

impl Pass {
    /// Whether anybody still listens and anything was read.
    fn run(&mut self) -> Result<bool, RecordingError> {
        let first = self.sequence;
        for message in self.reader.stereo()? {
            let mut pair = convert::pair(message?, self.sequence, self.form)?;
            pair.stamp_ns = self.stamps.next(pair.stamp_ns);
            self.sequence += 1;
            if self.pairs.blocking_send(Ok(pair)).is_err() {
                return Ok(false);
            }
        }
        if let Some(damage) = self.reader.damage() {
            tracing::warn!(damage, "the recording is damaged; it was streamed up to its last good record");
        }
        Ok(self.sequence > first)
    }
}

/// Keeps stamps going forward when a recording starts over.
#[derive(Debug, Default)]
struct Stamps {
    shift_ns: u64,
    newest_ns: u64,
    interval_ns: u64,
    restarting: bool,
}

impl Stamps {
    fn next(&mut self, recorded_ns: u64) -> u64 {
        if std::mem::take(&mut self.restarting) {
            let interval_ns = if self.interval_ns == 0 { USUAL_INTERVAL_NS } else { self.interval_ns };
            self.shift_ns = self.newest_ns.saturating_add(interval_ns).saturating_sub(recorded_ns);
        }
        let stamp_ns = recorded_ns.saturating_add(self.shift_ns);
        if self.newest_ns > 0 {
            self.interval_ns = stamp_ns.saturating_sub(self.newest_ns);
        }
        self.newest_ns = stamp_ns;
        stamp_ns
    }

    fn start_over(&mut self) {
        self.restarting = true;
    }
}

/// Puts each pair into the queue when it is due. The first error ends it.
///
/// # Errors
/// [`RecordingError`] where the recording cannot be read on.
pub async fn pace(
    mut pairs: mpsc::Receiver<Result<StereoPair, RecordingError>>,
    rate: f64,
    queue: QueueInlet,
) -> Result<(), RecordingError> {
    let mut start: Option<(Instant, u64)> = None;
    while let Some(pair) = pairs.recv().await {
        let pair = pair?;
        let (at, first_ns) = *start.get_or_insert_with(|| (Instant::now(), pair.stamp_ns));
        let since_first = Duration::from_nanos(pair.stamp_ns.saturating_sub(first_ns));
        tokio::time::sleep_until(at + since_first.div_f64(rate)).await;
        queue.put(pair);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_go_on_when_a_recording_starts_over() {
        let mut stamps = Stamps::default();
        let first: Vec<u64> = [100, 110, 120].map(|ns| stamps.next(ns)).to_vec();
        stamps.start_over();
        let second: Vec<u64> = [100, 110, 120].map(|ns| stamps.next(ns)).to_vec();
        assert_eq!((first, second), (vec![100, 110, 120], vec![130, 140, 150]));
    }
}
