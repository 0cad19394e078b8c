//! Dense surfel SLAM on the GPU.
//!
//! [`DenseSlam`] takes stereo pairs and poses. Inside, [`Observation`] is what disparity and preprocessing say of one stereo pair; [`SurfelModel`] fuses it under the
//! tracker's pose. Folders are named by the stages of a frame.

mod bend;
mod change_set;
mod compaction;
mod config;
pub mod disparity;
mod error;
mod flow;
mod followed;
mod fusion;
mod index_map;
mod model;
mod node_graph;
mod observation;
pub mod preprocess;
mod render;
mod slam;
mod statistics;
mod store;
pub mod synthetic;
#[cfg(test)]
mod testing;
mod tone;
mod view;
mod warp;
mod warp_solver;

pub use bend::FrameCorrection;
pub use change_set::{ChangeSet, EncodingSteps, NodePlace, TransformCodes, WarpChanges};
pub use config::{ColorConfig, DenseConfig, FusionConfig, PublishConfig, RejectionConfig};
pub use error::DenseError;
pub use flow::FlowConfig;
pub use model::{DiscardReason, FusionReport, Node, SurfelModel, WarpReport, kernels};
pub use node_graph::NodeConfig;
pub use observation::Observation;
pub use render::{BACKGROUND, Coloring, Rendering, render_surfels};
pub use slam::{Correspondence, DenseFrame, DenseSlam, StepReport, TrackedCamera};
pub use statistics::{BackProjection, HeldOut};
pub use store::{ModelArrays, Surfel};
pub use view::View;
pub use warp_solver::WarpConfig;
