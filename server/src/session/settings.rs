//! Section `[session]` of the configuration.

use std::time::Duration;

use serde::Deserialize;

/// Life times and limits of sessions.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionConfig {
    /// Sessions open at a time.
    pub sessions_max: usize,
    /// GPU time that a session may use before the next one that waits gets its turn.
    pub gpu_quantum_ms: f64,
    /// A session that no cart feeds is closed after this time.
    pub ttl_s: f64,
    /// A connected cart that sends nothing for this time counts as lost.
    pub source_silence_s: f64,
    /// A stamp may be ahead of the last one by the time passed and this much more.
    pub stamp_lead_max_s: f64,
    /// So many unusable pairs within a second degrade a session.
    pub degraded_bad_pairs: usize,
}

impl SessionConfig {
    /// [`Self::ttl_s`]
    pub fn ttl(&self) -> Duration {
        Duration::from_secs_f64(self.ttl_s)
    }

    /// [`Self::source_silence_s`]
    pub fn source_silence(&self) -> Duration {
        Duration::from_secs_f64(self.source_silence_s)
    }
}
