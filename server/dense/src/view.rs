//! A camera somewhere in the world.

use bytemuck::{Pod, Zeroable};
use geometry::{Pinhole, Pose};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// A pinhole camera and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub pinhole: Pinhole,
    /// Maps camera points to world points.
    pub world_from_camera: Pose,
}

/// `View` of `shared/view.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GpuView {
    pub intrinsics: [f32; 4],
    pub camera_from_world: [[f32; 4]; 3],
    pub world_from_camera: [[f32; 4]; 3],
    pub size: [u32; 2],
    padding: [u32; 2],
}

impl View {
    pub(crate) fn to_gpu(self) -> GpuView {
        let camera = &self.pinhole;
        GpuView {
            intrinsics: [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px].map(|value| value as f32),
            camera_from_world: rows(&self.world_from_camera.inverse()),
            world_from_camera: rows(&self.world_from_camera),
            size: [camera.width_px, camera.height_px],
            padding: [0; 2],
        }
    }
}

fn rows(pose: &Pose) -> [[f32; 4]; 3] {
    let matrix = pose.to_homogeneous();
    [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| matrix[(row, column)] as f32))
}

impl GpuView {
    /// The pose of the camera; its rotation is brought back to one where rounding has made it another matrix.
    pub fn world_from_camera(&self) -> Pose {
        let rows = self.world_from_camera;
        let matrix = Matrix3::from_fn(|row, column| f64::from(rows[row][column]));
        let rotation = UnitQuaternion::from_matrix(&matrix);
        Pose::from_parts(Vector3::from_fn(|row, _| f64::from(rows[row][3])).into(), rotation)
    }
}
