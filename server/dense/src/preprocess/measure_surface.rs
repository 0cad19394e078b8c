//! Wrapper of `measure_surface.wgsl`.

use bytemuck::{Pod, Zeroable};
use geometry::StereoRig;
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::upload::EyeBuffers;
use crate::Observation;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "measure_surface",
    include_str!("measure_surface.wgsl"),
    &[Uniform, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite, Read, ReadWrite],
);

/// Less disparity than this beyond that of infinity, in pixels, is all noise.
const DISPARITY_MIN_PX: f32 = 0.5;

/// `Triangulation` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Triangulation {
    intrinsics: [f32; 4],
    focal_baseline: f32,
    disparity_at_infinity: f32,
    disparity_min: f32,
    width: u32,
    height: u32,
    words: u32,
    incidence_cos_min: f32,
    padding: u32,
}

impl Triangulation {
    /// For disparities of which `drift_px` is not the depth's doing, of surfaces seen at up to `incidence_max_deg`.
    pub fn new(rig: &StereoRig, drift_px: f64, incidence_max_deg: f64) -> Self {
        let camera = &rig.left;
        Self {
            intrinsics: [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px].map(|value| value as f32),
            focal_baseline: (camera.fx_px * rig.baseline_m) as f32,
            disparity_at_infinity: (rig.disparity_at_infinity_px() + drift_px) as f32,
            disparity_min: DISPARITY_MIN_PX,
            width: camera.width_px,
            height: camera.height_px,
            words: camera.width_px.div_ceil(4),
            incidence_cos_min: incidence_max_deg.to_radians().cos() as f32,
            padding: 0,
        }
    }
}

/// Reads disparity planes and the left eye, writes the observation.
pub(super) fn bind(
    gpu: &Gpu,
    rig: &GpuBuffer<Triangulation>,
    planes: &GpuBuffer<[f32; 4]>,
    left: &EyeBuffers,
    observation: &Observation,
) -> Result<BoundKernel, GpuError> {
    let Observation { depth, sigma_z, normal, color, grey, .. } = observation;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[rig, planes, &left.color, &left.masked, depth, sigma_z, normal, color, &left.grey, grey])
}
