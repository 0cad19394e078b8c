//! The life of a session: facts come in, the status follows from them at one place ([`Lifecycle::settle`]).

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use protocol::SessionId;
use protocol::v1::{Reason, SessionStatus};

use super::SessionConfig;
use super::intake::Origin;

/// Time over which unusable pairs are counted.
const DEGRADED_WINDOW: Duration = Duration::from_secs(1);

/// Who feeds a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SourceId {
    /// The cart at the other end of a WebSocket: a number that this server gave.
    WebSocket(u64),
    /// A cart on zenoh, by the name that it gave itself.
    Zenoh(SessionId),
    /// A stored recording that is replayed.
    Replay,
    /// The session's own journal, after a crash of the server.
    Journal,
}

impl SourceId {
    /// Whether its pairs come from the network or from the disk.
    pub fn origin(&self) -> Origin {
        match self {
            Self::WebSocket(_) | Self::Zenoh(_) => Origin::Live,
            Self::Replay | Self::Journal => Origin::Stored,
        }
    }
}

/// What a session is told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A pair was taken.
    PairTaken,
    /// A pair came and could not be used.
    PairUnusable(Reason),
    /// A source is gone; another one than the present is ignored.
    SourceLeft(SourceId),
    /// A new calibration: the reconstruction starts anew.
    Calibrated,
    /// The reconstruction cannot go on.
    Failed(String),
    /// Somebody ends the session.
    Close(Closing),
    /// Time has passed.
    Tick,
}

/// How a session ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Closing {
    /// Why, for people.
    pub text: String,
    /// Somebody wanted just this session to end: its cart is not to open it again.
    pub on_purpose: bool,
}

impl Closing {
    /// Somebody asked for it.
    pub fn by_request() -> Self {
        Self { text: "closed by request".into(), on_purpose: true }
    }

    /// The session has come to its end, or the server has.
    pub fn because(text: &str) -> Self {
        Self { text: text.into(), on_purpose: false }
    }
}

/// Another source feeds the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SourceBusy {
    /// A cart, or a recording.
    #[error("another cart feeds this session")]
    Fed,
    /// After a crash of the server the session is being recovered from its journal.
    #[error("this session is being recovered; try again soon")]
    Recovering,
}

/// How firmly a source asks to feed a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claim {
    /// It gives way to one that is there.
    Polite,
    /// It has presented the takeover token.
    Takeover,
}

/// The facts about a session and the status that follows from them.
#[derive(Debug)]
pub struct Lifecycle {
    config: SessionConfig,
    status: SessionStatus,
    text: String,
    source: Option<SourceId>,
    /// When the source came or last sent anything.
    heard_at: Instant,
    /// Whether any pair was ever taken.
    fed: bool,
    /// Whether the last source was a recording, which has ended.
    played_out: bool,
    unusable_at: VecDeque<Instant>,
    last_unusable: Reason,
    failure: Option<String>,
    closing: Option<Closing>,
    /// Since when nobody feeds it.
    idle_since: Option<Instant>,
}

impl Lifecycle {
    /// A session that waits for its cart.
    pub fn new(config: &SessionConfig, now: Instant) -> Self {
        Self {
            config: config.clone(),
            status: SessionStatus::Waiting,
            text: "no cart yet".into(),
            source: None,
            heard_at: now,
            fed: false,
            played_out: false,
            unusable_at: VecDeque::new(),
            last_unusable: Reason::Unspecified,
            failure: None,
            closing: None,
            idle_since: Some(now),
        }
    }

    /// The status as of the last event.
    pub fn status(&self) -> SessionStatus {
        self.status
    }

    /// Why it is not live, for people; empty while live.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// How it ended, once it has.
    pub fn closing(&self) -> Option<Closing> {
        let ended = self.status == SessionStatus::Closed;
        // Where nobody asked for it, time did.
        ended.then(|| self.closing.clone().unwrap_or_else(|| Closing::because(&self.text)))
    }

    /// Whether a cart is connected.
    pub fn source_present(&self) -> bool {
        self.source.is_some()
    }

    /// The cart that feeds the session.
    pub fn source(&self) -> Option<&SourceId> {
        self.source.as_ref()
    }

    /// Whether this cart feeds the session.
    pub fn is_fed_by(&self, source: &SourceId) -> bool {
        self.source.as_ref() == Some(source)
    }

    /// A cart wants to feed the session; it takes the place of one that is silent.
    ///
    /// # Errors
    /// [`SourceBusy`].
    pub fn join(&mut self, source: SourceId, claim: Claim, now: Instant) -> Result<(), SourceBusy> {
        let silent = now.duration_since(self.heard_at) > self.config.source_silence();
        match &self.source {
            Some(SourceId::Journal) if source != SourceId::Journal => return Err(SourceBusy::Recovering),
            Some(SourceId::Replay) if source != SourceId::Replay => return Err(SourceBusy::Fed),
            Some(present) if *present != source && !silent && claim == Claim::Polite => {
                return Err(SourceBusy::Fed);
            }
            _ => {}
        }
        self.source = Some(source);
        self.heard_at = now;
        self.settle(now);
        Ok(())
    }

    /// Takes a fact in; whether the status changed.
    pub fn handle(&mut self, event: Event, now: Instant) -> bool {
        match event {
            Event::PairTaken => {
                self.heard_at = now;
                self.fed = true;
            }
            Event::PairUnusable(reason) => self.note_unusable(reason, now),
            Event::SourceLeft(source) if self.source.as_ref() == Some(&source) => {
                self.played_out = source == SourceId::Replay;
                self.source = None;
            }
            Event::SourceLeft(_) | Event::Tick => {}
            Event::Calibrated => self.failure = None,
            Event::Failed(text) => self.failure = Some(text),
            Event::Close(closing) => self.closing = Some(closing),
        }
        self.settle(now)
    }

    /// The memory is bounded: more than the threshold need not be known.
    fn note_unusable(&mut self, reason: Reason, now: Instant) {
        self.heard_at = now;
        self.last_unusable = reason;
        self.unusable_at.push_back(now);
        if self.unusable_at.len() > self.config.degraded_bad_pairs {
            self.unusable_at.pop_front();
        }
    }

    /// The one place where the status changes.
    fn settle(&mut self, now: Instant) -> bool {
        let (status, text) = self.status_at(now);
        let idle = matches!(status, SessionStatus::Waiting | SessionStatus::SourceLost);
        self.idle_since = if idle { self.idle_since.or(Some(now)) } else { None };
        let changed = status != self.status;
        self.status = status;
        self.text = text;
        changed
    }

    fn status_at(&self, now: Instant) -> (SessionStatus, String) {
        if self.status == SessionStatus::Closed {
            return (SessionStatus::Closed, self.text.clone());
        }
        if let Some(closing) = &self.closing {
            return (SessionStatus::Closed, closing.text.clone());
        }
        if self.idle_since.is_some_and(|since| now.duration_since(since) >= self.config.ttl()) {
            return (SessionStatus::Closed, format!("no cart for {} s", self.config.ttl_s));
        }
        let silence = now.duration_since(self.heard_at);
        match (&self.source, self.fed) {
            (Some(SourceId::Journal), _) => {
                (SessionStatus::Recovering, "the journal is worked through after a crash".into())
            }
            (None, false) => (SessionStatus::Waiting, "no cart yet".into()),
            (None, true) if self.played_out => {
                (SessionStatus::SourceLost, "the recording has ended; the model is held".into())
            }
            (None, true) => (SessionStatus::SourceLost, "the cart is gone; the model is held".into()),
            (Some(_), false) if self.unusable_at.is_empty() => {
                (SessionStatus::Waiting, "the cart has sent no pair yet".into())
            }
            // A recording may be paused, or wait for a slow reconstruction; it says when it ends.
            (Some(source), _) if *source != SourceId::Replay && silence > self.config.source_silence() => (
                SessionStatus::SourceLost,
                format!("the cart is silent for over {} s", self.config.source_silence_s),
            ),
            (Some(_), _) => self.status_while_fed(now),
        }
    }

    fn status_while_fed(&self, now: Instant) -> (SessionStatus, String) {
        if let Some(failure) = &self.failure {
            return (SessionStatus::Degraded, failure.clone());
        }
        let recent = self.unusable_at.iter().filter(|at| now.duration_since(**at) < DEGRADED_WINDOW).count();
        if recent >= self.config.degraded_bad_pairs {
            let last = self.last_unusable.name();
            return (SessionStatus::Degraded, format!("many pairs cannot be used, the last one: {last}"));
        }
        (SessionStatus::Live, String::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Clock(Instant);

    impl Clock {
        fn after(&mut self, seconds: f64) -> Instant {
            self.0 += Duration::from_secs_f64(seconds);
            self.0
        }
    }

    fn config() -> SessionConfig {
        SessionConfig {
            sessions_max: 4,
            gpu_quantum_ms: 10.0,
            ttl_s: 600.0,
            source_silence_s: 2.0,
            stamp_lead_max_s: 10.0,
            degraded_bad_pairs: 3,
        }
    }

    fn cart(name: &str) -> SourceId {
        SourceId::Zenoh(name.parse().expect("a valid id"))
    }

    fn live() -> (Lifecycle, Clock) {
        let mut clock = Clock(Instant::now());
        let mut session = Lifecycle::new(&config(), clock.0);
        session.join(cart("a"), Claim::Polite, clock.after(0.1)).unwrap();
        session.handle(Event::PairTaken, clock.after(0.1));
        (session, clock)
    }

    #[test]
    fn a_session_waits_until_its_first_pair() {
        let mut clock = Clock(Instant::now());
        let mut session = Lifecycle::new(&config(), clock.0);
        assert_eq!(session.status(), SessionStatus::Waiting);
        session.join(cart("a"), Claim::Polite, clock.after(1.0)).unwrap();
        assert_eq!(session.status(), SessionStatus::Waiting);
        assert!(session.handle(Event::PairTaken, clock.after(1.0)));
        assert_eq!((session.status(), session.text()), (SessionStatus::Live, ""));
    }

    #[test]
    fn a_cart_that_leaves_is_a_lost_source_at_once_and_may_come_back() {
        let (mut session, mut clock) = live();
        assert!(session.handle(Event::SourceLeft(cart("a")), clock.after(0.0)));
        assert_eq!(session.status(), SessionStatus::SourceLost);
        session.join(cart("b"), Claim::Polite, clock.after(5.0)).unwrap();
        session.handle(Event::PairTaken, clock.after(0.1));
        assert_eq!(session.status(), SessionStatus::Live);
    }

    #[test]
    fn a_second_cart_is_refused_while_the_first_sends() {
        let (mut session, mut clock) = live();
        assert_eq!(session.join(cart("b"), Claim::Polite, clock.after(0.5)), Err(SourceBusy::Fed));
        assert!(session.is_fed_by(&cart("a")));
        assert_eq!(session.join(cart("a"), Claim::Polite, clock.after(0.0)), Ok(()));
    }

    #[test]
    fn a_takeover_puts_the_first_cart_out_and_its_leaving_changes_nothing() {
        let (mut session, mut clock) = live();
        assert_eq!(session.join(cart("b"), Claim::Takeover, clock.after(0.1)), Ok(()));
        session.handle(Event::SourceLeft(cart("a")), clock.after(0.1));
        assert!(session.is_fed_by(&cart("b")));
    }

    #[test]
    fn nobody_feeds_a_session_that_is_recovered_or_replays() {
        let mut clock = Clock(Instant::now());
        let mut session = Lifecycle::new(&config(), clock.0);
        session.join(SourceId::Journal, Claim::Polite, clock.after(0.1)).unwrap();
        assert_eq!(session.status(), SessionStatus::Recovering);
        let refused = session.join(cart("a"), Claim::Takeover, clock.after(60.0));
        assert_eq!(refused, Err(SourceBusy::Recovering));
        session.handle(Event::SourceLeft(SourceId::Journal), clock.after(0.1));
        session.join(SourceId::Replay, Claim::Polite, clock.after(0.1)).unwrap();
        assert_eq!(session.join(cart("a"), Claim::Takeover, clock.after(60.0)), Err(SourceBusy::Fed));
    }

    #[test]
    fn a_replay_that_is_paused_or_waits_for_a_slow_reconstruction_is_no_lost_source() {
        let mut clock = Clock(Instant::now());
        let mut session = Lifecycle::new(&config(), clock.0);
        session.join(SourceId::Replay, Claim::Polite, clock.after(0.1)).unwrap();
        session.handle(Event::PairTaken, clock.after(0.1));
        session.handle(Event::Tick, clock.after(30.0));
        assert_eq!(session.status(), SessionStatus::Live);
        session.handle(Event::SourceLeft(SourceId::Replay), clock.after(0.1));
        assert!(session.text().contains("recording has ended"), "{}", session.text());
    }

    #[test]
    fn a_silent_cart_is_a_lost_source_and_gives_way() {
        let (mut session, mut clock) = live();
        assert!(session.handle(Event::Tick, clock.after(2.1)));
        assert_eq!(session.status(), SessionStatus::SourceLost);
        session.join(cart("b"), Claim::Polite, clock.after(0.1)).unwrap();
        session.handle(Event::SourceLeft(cart("a")), clock.after(0.1));
        assert!(session.is_fed_by(&cart("b")));
    }

    #[test]
    fn many_unusable_pairs_degrade_a_session_and_good_ones_restore_it() {
        let (mut session, mut clock) = live();
        for _ in 0..3 {
            session.handle(Event::PairUnusable(Reason::MalformedImage), clock.after(0.1));
        }
        assert_eq!(session.status(), SessionStatus::Degraded);
        assert!(session.text().contains("malformed_image"), "{}", session.text());
        session.handle(Event::PairTaken, clock.after(1.0));
        assert_eq!(session.status(), SessionStatus::Live);
    }

    #[test]
    fn a_failed_reconstruction_says_why_until_it_starts_anew() {
        let (mut session, mut clock) = live();
        session.handle(Event::Failed("GPU lost".into()), clock.after(0.1));
        assert_eq!((session.status(), session.text()), (SessionStatus::Degraded, "GPU lost"));
        session.handle(Event::Calibrated, clock.after(0.1));
        assert_eq!(session.status(), SessionStatus::Live);
    }

    #[test]
    fn a_session_without_a_cart_is_closed_after_its_time_to_live() {
        let (mut session, mut clock) = live();
        session.handle(Event::SourceLeft(cart("a")), clock.after(0.1));
        session.handle(Event::Tick, clock.after(599.0));
        assert_eq!(session.status(), SessionStatus::SourceLost);
        assert_eq!(session.closing(), None);
        assert!(session.handle(Event::Tick, clock.after(1.1)));
        assert_eq!(session.status(), SessionStatus::Closed);
        assert_eq!(session.closing(), Some(Closing::because("no cart for 600 s")));
    }

    #[test]
    fn nothing_reopens_a_closed_session() {
        let (mut session, mut clock) = live();
        session.handle(Event::Close(Closing::by_request()), clock.after(0.1));
        session.handle(Event::PairTaken, clock.after(0.1));
        assert_eq!((session.status(), session.text()), (SessionStatus::Closed, "closed by request"));
        assert_eq!(session.closing(), Some(Closing::by_request()));
    }
}
