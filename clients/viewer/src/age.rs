//! How old what is shown is. Clocks of server and viewer need not agree: the server says ages, not times.

use std::time::{Duration, Instant};

use protocol::v1::SessionStatus;

/// Silence of the model lane after which what it brought counts as stale (design section 8).
pub const STALE_AFTER: Duration = Duration::from_millis(500);

/// Age of what a lane last brought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DataAge {
    heard: Option<Instant>,
    age_when_heard: Duration,
}

impl DataAge {
    /// Data came.
    pub fn heard(&mut self, now: Instant) {
        self.heard = Some(now);
    }

    /// The server says how old its newest data are: what is shown is at least as old.
    pub fn server_says(&mut self, now: Instant, age: Duration) {
        // Before the first data, those that come next are as old.
        let since = self.heard.map_or(Duration::ZERO, |heard| now.duration_since(heard));
        self.age_when_heard = age.saturating_sub(since);
    }

    /// Time since data last came; `None` before the first.
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        self.heard.map(|heard| now.duration_since(heard))
    }

    /// Age of what is shown; `None` before the first data.
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.silence(now).map(|silence| silence + self.age_when_heard)
    }
}

/// Whether the model has to be shown as stale: silence while new data should come. A model whose source is gone, or
/// which has ended, is held as it is; its age is said in words.
pub fn is_stale(status: SessionStatus, silence: Option<Duration>) -> bool {
    let expected = matches!(status, SessionStatus::Live | SessionStatus::Degraded);
    expected && silence.is_some_and(|silence| silence > STALE_AFTER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_is_as_old_as_the_server_says_and_grows_older_in_silence() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut age = DataAge::default();
        assert_eq!((age.silence(at(0)), age.age(at(0))), (None, None));
        age.heard(at(100));
        age.server_says(at(150), Duration::from_millis(90));
        assert_eq!(age.age(at(200)), Some(Duration::from_millis(140)));
        assert_eq!(age.silence(at(200)), Some(Duration::from_millis(100)));
    }

    #[test]
    fn data_of_a_model_that_stands_still_are_as_old_as_was_said_before() {
        let now = Instant::now();
        let mut age = DataAge::default();
        age.server_says(now, Duration::from_secs(15));
        age.heard(now);
        assert_eq!(age.age(now), Some(Duration::from_secs(15)));
    }

    #[test]
    fn only_a_session_that_should_bring_data_goes_stale() {
        let silence = |ms| Some(Duration::from_millis(ms));
        assert!(is_stale(SessionStatus::Live, silence(501)));
        assert!(is_stale(SessionStatus::Degraded, silence(9000)));
        assert!(!is_stale(SessionStatus::Live, silence(500)));
        assert!(!is_stale(SessionStatus::Live, None));
        assert!(!is_stale(SessionStatus::SourceLost, silence(9000)));
    }
}
