//! Growing and tending the map whenever a frame becomes a keyframe.
//!
//! The tracker itself inserts the keyframe, which is quick; the [`Mapper`]'s thread does the rest.

pub mod adjustment;
mod culling;
pub mod edit;
pub mod fusion;
mod insertion;
mod mapper;
mod refinement;
pub mod triangulation;
mod window;
mod work;

pub use culling::{cull, cull_redundant};
pub use insertion::{PosedFrame, insert_keyframe};
pub use mapper::{Mapper, MappingPace};
pub use refinement::refine_points;
pub use window::Window;
pub use work::{Finished, MappingContext, Work};
