//! The camera is back where it was: the drift since then is taken out of the map.
//!
//! Suspicion (the new keyframe looks like an old one that it shares no points with), proof (a rigid motion that enough points agree with),
//! correction (a pose graph over the keyframes; points follow; what was seen twice becomes one).

mod correction;
mod detection;

pub use correction::close;
pub use detection::{LoopClosure, Suspicion, suspect};
