//! What one stereo pair shows: the interface between disparity and fusion.

use gpu::{Gpu, GpuBuffer, GpuError};

/// One frame's measured surface on the GPU, in the rectified left view, one element per pixel in row order.
///
/// Disparity and preprocessing write it in the frame's encoder; fusion reads it in the same submission. Buffers
/// are made once and written over by each frame; a clone is another handle to the same buffers. A pixel counts as measured where depth, spread and normal are
/// all valid.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Depth along the optical axis, metres; `0` where unknown or masked.
    pub depth: GpuBuffer<f32>,
    /// Standard deviation of the depth, metres: `z^2 / (f b) * sigma_d`.
    pub sigma_z: GpuBuffer<f32>,
    /// Unit normal in the camera frame, facing the camera (`n . ray < 0`); `w` is 1 where valid, else 0.
    pub normal: GpuBuffer<[f32; 4]>,
    /// 8-bit red, green, blue from the lowest byte up; the highest byte is 255 where the colour shows the tissue
    /// and 0 where it does not (specular highlight, mask).
    pub color: GpuBuffer<u32>,
    /// Rec. 601 luma from 0 to 255 where the colour shows the tissue, -1 where it does not.
    pub grey: GpuBuffer<f32>,
}

impl Observation {
    /// Buffers for images of `width` x `height`.
    ///
    /// # Errors
    /// As [`Gpu::storage`].
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Result<Self, GpuError> {
        let pixels = width as usize * height as usize;
        Ok(Self {
            width,
            height,
            depth: gpu.storage("depth", pixels)?,
            sigma_z: gpu.storage("sigma_z", pixels)?,
            normal: gpu.storage("normal", pixels)?,
            color: gpu.storage("color", pixels)?,
            grey: gpu.storage("grey", pixels)?,
        })
    }

    /// Pixels of the image.
    pub fn pixels(&self) -> u32 {
        self.width * self.height
    }
}
