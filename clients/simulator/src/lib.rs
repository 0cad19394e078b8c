//! Deforming-organ stereo scenes with ground truth.
//!
//! A procedural organ is meshed, textured in its own coordinates, pushed and breathed, and seen by a rectified stereo
//! scope that crosses it and comes back. Each frame carries its exact pose, depth and material points; the run carries
//! the deforming surface in closed form. The same configuration gives the same bits whatever the number of threads.

mod camera_path;
mod config;
mod deformation;
mod error;
mod material_points;
mod motion;
mod picture;
mod scene;
mod shape;
mod simulation;
mod texture;
mod truth_mesh;

pub use config::{SceneConfig, SceneKind};
pub use deformation::Push;
pub use error::SimulatorError;
pub use simulation::{SimulatedFrame, Simulation};
pub use truth_mesh::TruthMesh;
