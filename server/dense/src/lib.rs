//! Dense surfel SLAM on the GPU.

mod observation;

pub use observation::Observation;
