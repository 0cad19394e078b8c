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

/// Lets one through per period, the first at once.
#[derive(Debug)]
pub struct Throttle {
    period: Duration,
    last: Option<Instant>,
}

impl Throttle {
    /// At most `rate_hz` a second.
    pub fn new(rate_hz: f64) -> Self {
        let period = Duration::try_from_secs_f64(rate_hz.recip()).unwrap_or(Duration::MAX);
        Self { period, last: None }
    }

    /// Whether one may go now; it then counts as gone.
    pub fn admits(&mut self, now: Instant) -> bool {
        let due = self.last.is_none_or(|last| now.duration_since(last) >= self.period);
        if due {
            self.last = Some(now);
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_throttle_admits_the_first_and_then_one_per_period() {
        let start = Instant::now();
        let mut throttle = Throttle::new(10.0);
        let at = |ms| start + Duration::from_millis(ms);
        let admitted: Vec<_> =
            [0, 50, 100, 199, 200].into_iter().filter(|&ms| throttle.admits(at(ms))).collect();
        assert_eq!(admitted, [0, 100, 200]);
    }

    #[test]
    fn a_rate_of_zero_admits_only_the_first() {
        let start = Instant::now();
        let mut throttle = Throttle::new(0.0);
        assert!(throttle.admits(start));
        assert!(!throttle.admits(start + Duration::from_secs(3600)));
    }
}
