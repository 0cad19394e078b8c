//! Names of the enumerations for JSON and for people.

use crate::v1::{Reason, SessionStatus, TrackingOutcome};

/// `PREFIX_SOME_NAME` as `some_name`.
fn short_name(full: &str, prefix: &str) -> String {
    full.strip_prefix(prefix).unwrap_or(full).to_ascii_lowercase()
}

impl Reason {
    /// The name in JSON: `stale_stamp`.
    pub fn name(self) -> String {
        short_name(self.as_str_name(), "REASON_")
    }
}

impl SessionStatus {
    /// The name in JSON: `source_lost`.
    pub fn name(self) -> String {
        short_name(self.as_str_name(), "SESSION_STATUS_")
    }
}

impl TrackingOutcome {
    /// The name in JSON: `not_initialized`.
    pub fn name(self) -> String {
        short_name(self.as_str_name(), "TRACKING_OUTCOME_")
    }
}
