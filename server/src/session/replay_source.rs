//! A stored recording in the place of a cart: at its own pace, slower, faster or as fast as pairs are taken; paused,
//! and moved to any time.

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use protocol::v1::ReplayPosition;
use recording::{Calibration, RecordingConfig, RecordingError, RecordingReader};

use super::lifecycle::SourceId;
use super::live::Session;
use super::mailbox::Policy;
use crate::convert;

/// How often a replay at rest says where it is, and looks whether anybody is there.
const SIGN_OF_LIFE: Duration = Duration::from_millis(500);

/// A recording opened for replay.
pub struct ReplaySource {
    name: String,
    reader: RecordingReader,
    calibration: Calibration,
    span_ns: (u64, u64),
}

impl ReplaySource {
    /// Opens a recording and finds its cameras and its span. Reads the file: not for the async runtime.
    ///
    /// # Errors
    /// [`RecordingError`]: no recording, no usable calibration, no pair.
    pub fn open(name: &str, path: &Path, config: &RecordingConfig) -> Result<Self, RecordingError> {
        let reader = RecordingReader::open(path, config)?;
        let calibration = reader.calibration()?;
        let span_ns = reader.stereo_span_ns()?;
        Ok(Self { name: name.to_owned(), reader, calibration, span_ns })
    }

    /// The cameras.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Starts the thread that feeds a session; it ends when the control is stopped or the session is gone.
    ///
    /// # Errors
    /// The system's, where no thread can be started.
    pub fn feed(self, session: &Arc<Session>, control: Arc<ReplayControl>) -> std::io::Result<()> {
        let feeder = Feeder { source: self, session: Arc::downgrade(session), control };
        std::thread::Builder::new().name("replay".into()).spawn(move || feeder.run()).map(drop)
    }
}

/// What a viewer may change, and where the replay is.
#[derive(Debug)]
pub struct ReplayControl {
    wanted: Mutex<Wanted>,
    changed: Condvar,
}

#[derive(Clone, Copy, Debug)]
struct Wanted {
    paused: bool,
    /// Times the recorded pace; 0: as fast as pairs are taken.
    rate: f64,
    /// Time since the first pair to go to.
    seek_ns: Option<u64>,
    stopped: bool,
    /// Counts the changes, so that the pace starts afresh after each.
    changes: u64,
}

/// A change; what is `None` stays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReplayChange {
    /// Whether no more pairs are handed on.
    pub paused: Option<bool>,
    /// Time since the first pair to go to.
    pub position: Option<Duration>,
    /// Times the recorded pace; 0: as fast as pairs are taken.
    pub rate: Option<f64>,
}

impl ReplayControl {
    /// A replay that starts at the recording's first pair.
    pub fn new(rate: f64, paused: bool) -> Arc<Self> {
        let wanted = Wanted { paused, rate, seek_ns: None, stopped: false, changes: 0 };
        Arc::new(Self { wanted: Mutex::new(wanted), changed: Condvar::new() })
    }

    fn wanted(&self) -> MutexGuard<'_, Wanted> {
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes pace or place.
    pub fn change(&self, change: ReplayChange) {
        let mut wanted = self.wanted();
        wanted.paused = change.paused.unwrap_or(wanted.paused);
        wanted.rate = change.rate.unwrap_or(wanted.rate);
        wanted.seek_ns = change.position.map(|at| at.as_nanos() as u64).or(wanted.seek_ns);
        wanted.changes += 1;
        self.changed.notify_all();
    }

    /// Ends the replay.
    pub fn stop(&self) {
        self.wanted().stopped = true;
        self.changed.notify_all();
    }

    /// Waits for a change, at most this long.
    fn wait(&self, patience: Duration) -> Wanted {
        let wanted = self.wanted();
        let seen = wanted.changes;
        let unchanged = |now: &mut Wanted| now.changes == seen && !now.stopped;
        *self
            .changed
            .wait_timeout_while(wanted, patience, unchanged)
            .unwrap_or_else(PoisonError::into_inner)
            .0
    }
}

/// Why handing pairs on stopped.
enum Pause {
    /// All pairs are through.
    Ended,
    /// Go on at this time since the first pair.
    Seek(u64),
    /// Nobody wants more.
    Stopped,
}

struct Feeder {
    source: ReplaySource,
    /// The session owns the control, not the feeder the session.
    session: Weak<Session>,
    control: Arc<ReplayControl>,
}

impl Feeder {
    fn run(self) {
        let mut from_ns = 0;
        loop {
            let pause = self.hand_on(from_ns).unwrap_or_else(|error| {
                self.tell(|session| session.hub().fail(error.to_string()));
                Pause::Ended
            });
            let seek_ns = match pause {
                Pause::Stopped => return,
                Pause::Seek(seek_ns) => Some(seek_ns),
                Pause::Ended => self.rest_at_end(),
            };
            let Some(seek_ns) = seek_ns else { return };
            if !self.restart() {
                return;
            }
            from_ns = seek_ns;
        }
    }

    fn tell(&self, what: impl FnOnce(&Arc<Session>)) -> bool {
        self.session.upgrade().as_ref().map(what).is_some()
    }

    /// The model of another place starts anew.
    fn restart(&self) -> bool {
        self.tell(|session| {
            if let Err(error) = session.restart(&self.source.calibration) {
                session.hub().fail(error.0);
            }
            // Nobody else may join a replay.
            let _ = session.hub().join(SourceId::Replay, "");
        })
    }

    /// Hands pairs on from a time on.
    fn hand_on(&self, from_ns: u64) -> Result<Pause, RecordingError> {
        let (first_ns, _) = self.source.span_ns;
        let mut pace = Pace::default();
        let pairs = self.source.reader.stereo_from(first_ns.saturating_add(from_ns))?;
        for (sequence, message) in pairs.enumerate() {
            let message = message?;
            let position_ns = message.stamp_ns.saturating_sub(first_ns);
            let policy = match self.wait_until_due(position_ns, &mut pace) {
                Ok(policy) => policy,
                Err(pause) => return Ok(pause),
            };
            let size_px = self.source.calibration.image_size_px();
            let pair = convert::pair_to_wire(message, sequence as u64, size_px);
            let alive = self.tell(|session| {
                // Refused pairs are counted by the session.
                let _ = session.take(&SourceId::Replay, pair, policy);
                session.hub().set_replay(self.position(position_ns, false));
            });
            if !alive {
                return Ok(Pause::Stopped);
            }
        }
        Ok(Pause::Ended)
    }

    /// Lets time pass until a pair is due by the wanted pace.
    fn wait_until_due(&self, position_ns: u64, pace: &mut Pace) -> Result<Policy, Pause> {
        loop {
            let wanted = *self.control.wanted();
            if wanted.stopped {
                return Err(Pause::Stopped);
            }
            if let Some(seek_ns) = self.control.wanted().seek_ns.take() {
                return Err(Pause::Seek(seek_ns));
            }
            if wanted.paused {
                if !self.tell(|session| session.hub().set_replay(self.position(position_ns, false))) {
                    return Err(Pause::Stopped);
                }
                pace.forget();
                self.control.wait(SIGN_OF_LIFE);
                continue;
            }
            if wanted.rate == 0.0 {
                pace.forget();
                return Ok(Policy::Lossless);
            }
            let left = pace.time_left(position_ns, &wanted);
            if left.is_zero() {
                return Ok(Policy::NewestWins);
            }
            self.control.wait(left);
        }
    }

    /// The recording has ended: its model is held until somebody moves back or the session is closed.
    fn rest_at_end(&self) -> Option<u64> {
        let (first_ns, last_ns) = self.source.span_ns;
        let alive = self.tell(|session| {
            session.hub().set_replay(self.position(last_ns - first_ns, true));
            session.hub().leave(&SourceId::Replay);
        });
        while alive && self.session.strong_count() > 0 {
            let wanted = self.control.wait(SIGN_OF_LIFE);
            if wanted.stopped {
                return None;
            }
            if let Some(seek_ns) = self.control.wanted().seek_ns.take() {
                return Some(seek_ns);
            }
        }
        None
    }

    fn position(&self, position_ns: u64, ended: bool) -> ReplayPosition {
        let wanted = *self.control.wanted();
        let (first_ns, last_ns) = self.source.span_ns;
        ReplayPosition {
            recording: self.source.name.clone(),
            position_ns,
            duration_ns: last_ns - first_ns,
            paused: wanted.paused,
            rate: wanted.rate,
            ended,
        }
    }
}

/// When pairs are due, counted from the last change of pace.
#[derive(Default)]
struct Pace {
    start: Option<(Instant, u64, u64)>,
}

impl Pace {
    fn forget(&mut self) {
        self.start = None;
    }

    fn time_left(&mut self, position_ns: u64, wanted: &Wanted) -> Duration {
        if self.start.is_some_and(|(_, _, changes)| changes != wanted.changes) {
            self.forget();
        }
        let (at, start_ns, _) = *self.start.get_or_insert((Instant::now(), position_ns, wanted.changes));
        let since_start_s = position_ns.saturating_sub(start_ns) as f64 * 1e-9 / wanted.rate;
        let due = Duration::try_from_secs_f64(since_start_s).unwrap_or(Duration::MAX);
        due.saturating_sub(at.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_due_by_the_rate_and_a_change_starts_afresh() {
        let wanted = Wanted { paused: false, rate: 0.5, seek_ns: None, stopped: false, changes: 0 };
        let mut pace = Pace::default();
        assert_eq!(pace.time_left(7_000_000_000, &wanted), Duration::ZERO);
        let left_s = pace.time_left(57_000_000_000, &wanted).as_secs_f64();
        assert!((99.0..=100.0).contains(&left_s), "{left_s}");
        let changed = Wanted { changes: 1, ..wanted };
        assert_eq!(pace.time_left(57_000_000_000, &changed), Duration::ZERO);
    }

    #[test]
    fn a_change_keeps_what_it_does_not_name() {
        let control = ReplayControl::new(1.0, false);
        control.change(ReplayChange { rate: Some(2.0), ..ReplayChange::default() });
        control.change(ReplayChange { paused: Some(true), ..ReplayChange::default() });
        let wanted = *control.wanted();
        assert_eq!((wanted.rate, wanted.paused, wanted.seek_ns), (2.0, true, None));
    }
}
