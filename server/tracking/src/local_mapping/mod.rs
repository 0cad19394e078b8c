//! Growing and tending the map whenever a frame becomes a keyframe.

mod culling;
mod insertion;
mod refinement;

pub use culling::cull;
pub use insertion::{PosedFrame, insert_keyframe};
pub use refinement::refine_points;
