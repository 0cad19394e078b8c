//! What leaves a session: lanes that any number of viewers follow, each message encoded once for all of them.
//!
//! Pose, state and preview are latest-wins (a `watch`); the model is ordered and complete ([`model_lane`]).

use std::time::{Duration, Instant};

use serde::Deserialize;

use model_lane::LagLimits;

pub mod model_lane;
pub mod viewer;
pub mod zenoh;

/// Section `[publish]` of the configuration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishConfig {
    /// Model epochs a second, at most.
    pub model_hz: f64,
    /// Session states a second, besides those sent at changes.
    pub state_hz: f64,
    /// Preview images a second, at most.
    pub preview_hz: f64,
    /// JPEG quality of preview images, 1 to 100.
    pub preview_jpeg_quality: u8,
    /// Whether the tracker's features are drawn into them.
    pub preview_features: bool,
    /// Model epochs waiting for one viewer; beyond it the viewer is seeded anew.
    pub viewer_budget_mib: f64,
    /// Age of the oldest of them; beyond it likewise.
    pub viewer_lag_s: f64,
    /// A viewer that takes nothing for this time is let go.
    pub viewer_stall_s: f64,
}

impl PublishConfig {
    /// What one viewer may lag behind.
    pub fn lag_limits(&self) -> LagLimits {
        LagLimits {
            bytes: (self.viewer_budget_mib * f64::from(1 << 20)) as usize,
            age: Duration::try_from_secs_f64(self.viewer_lag_s).unwrap_or(Duration::MAX),
        }
    }
}

/// Lets as many through as a rate allows, the first at once. Frames do not come evenly: one may be early by a quarter of
/// the period, and then the next one is due as if it had not been.
#[derive(Debug)]
pub struct Throttle {
    /// None where there is never a second one.
    period: Option<Duration>,
    due: Due,
}

#[derive(Debug)]
enum Due {
    Now,
    At(Instant),
    Never,
}

impl Throttle {
    /// At most `rate_hz` a second.
    pub fn new(rate_hz: f64) -> Self {
        Self { period: Duration::try_from_secs_f64(rate_hz.recip()).ok(), due: Due::Now }
    }

    /// Whether one may go now; it then counts as gone.
    pub fn admits(&mut self, now: Instant) -> bool {
        let period = self.period.unwrap_or_default();
        let from = match self.due {
            Due::Now => now,
            // the rate is kept to, whether the last ones came early or late, unless whole ones were missed
            Due::At(due) if now.saturating_duration_since(due) >= period => now,
            Due::At(due) if due.saturating_duration_since(now) <= period / 4 => due,
            Due::At(_) | Due::Never => return false,
        };
        let next = self.period.and_then(|period| from.checked_add(period));
        self.due = next.map_or(Due::Never, Due::At);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_throttle_admits_the_first_and_then_one_per_period_or_a_little_early() {
        let start = Instant::now();
        let mut throttle = Throttle::new(10.0);
        let at = |ms| start + Duration::from_millis(ms);
        let admitted: Vec<_> = [0, 50, 100, 180, 205, 274, 275, 1000]
            .into_iter()
            .filter(|&ms| throttle.admits(at(ms)))
            .collect();
        assert_eq!(admitted, [0, 100, 180, 275, 1000], "due at 0, 100, 200, 300 and then anew");
    }

    #[test]
    fn frames_at_the_rate_itself_all_pass_though_they_come_unevenly() {
        let start = Instant::now();
        let mut throttle = Throttle::new(30.0);
        let early_ms = [0.0, 5.0, -4.0, 7.0, 0.0, -3.0, 6.0, 2.0];
        let at = |(frame, early_ms): (usize, f64)| {
            start + Duration::from_secs_f64(frame as f64 / 30.0 + 0.01 - early_ms * 1e-3)
        };
        assert!(early_ms.into_iter().enumerate().all(|frame| throttle.admits(at(frame))));
    }

    #[test]
    fn a_rate_of_zero_admits_only_the_first() {
        let start = Instant::now();
        let mut throttle = Throttle::new(0.0);
        assert!(throttle.admits(start));
        assert!(!throttle.admits(start + Duration::from_secs(3600)));
    }
}
