//! The CPU stereo tracker: an ORB-SLAM2-class front end (Mur-Artal and Tardos 2017), tuned for tissue as
//! Mahmoud et al. (2016) did: more features, a lower FAST threshold, wider windows.
//!
//! [`Tracker::track`] takes a rectified pair and gives a [`TrackingReport`]. The folders follow a frame's way:
//! [`feature`] finds corners, [`matching`] finds them again, [`solve`] turns matches into poses and points, [`map`] holds
//! keyframes and points, [`local_mapping`] tends them on a thread of its own, [`relocalization`] recognises places,
//! [`loop_closing`] takes drift out where the camera comes back, [`optimize`] holds the large least-squares problems of both,
//! [`following`] keeps what moves with the tissue, `tracker` decides. In lockstep ([`MappingPace`]) everything is deterministic:
//! the same frames give the same poses, whatever the number of threads.

pub mod config;
mod dispatch;
mod error;
pub mod feature;
pub mod following;
mod frame;
pub mod local_mapping;
pub mod loop_closing;
pub mod map;
pub mod matching;
pub mod optimize;
pub mod relocalization;
mod report;
pub mod solve;
mod tracker;

pub use config::{TrackingConfig, TrackingMode};
pub use error::TrackingError;
pub use frame::{FrameFeatures, StereoFrame};
pub use local_mapping::MappingPace;
pub use report::{
    CorrectionKind, FeatureMotion, KeyframeCorrection, KeyframeReason, MapCorrection, Outcome, PoseSource,
    StereoDrift, TrackId, TrackedFeature, TrackingReport, TrackingStatistics,
};
pub use tracker::Tracker;
