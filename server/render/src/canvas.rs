//! A target without a window.

use geometry::Rgb;
use gpu::{Gpu, GpuBuffer, GpuError};

use crate::target::{DepthBuffer, Target, texture};

/// Rows in a buffer start at multiples of so many pixels of four bytes.
const ROW_ALIGNMENT_PX: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4;

/// A picture that is drawn into and read back.
#[derive(Debug)]
pub struct Canvas {
    size_px: (u32, u32),
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    depth: DepthBuffer,
    rows: GpuBuffer<[u8; 4]>,
}

impl Canvas {
    /// The format of its colours.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

    /// Of this size, columns and rows.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`], [`GpuError::OutOfMemory`], and [`GpuError::Validation`] of a size that the device
    /// does not take.
    pub fn new(gpu: &Gpu, size_px: (u32, u32)) -> Result<Self, GpuError> {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let texture = texture(gpu, "canvas", size_px, (Self::FORMAT, usage));
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let rows = gpu.storage("canvas rows", row_px(size_px.0) as usize * size_px.1 as usize)?;
        let canvas = Self { size_px, texture, view, depth: DepthBuffer::new(gpu, size_px), rows };
        gpu.health()?;
        Ok(canvas)
    }

    /// What is drawn into.
    pub fn target(&self) -> Target<'_> {
        Target { color: &self.view, depth: &self.depth }
    }

    /// The picture as of all that was submitted.
    ///
    /// # Errors
    /// [`GpuError`] of the drawing or the readback.
    pub fn read(&self, gpu: &Gpu) -> Result<Rgb, GpuError> {
        let (width, height) = self.size_px;
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row_px(width) * 4),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: self.rows.raw(), layout },
            self.texture.size(),
        );
        gpu.queue().submit([encoder.finish()]);
        let rows = gpu.read(&self.rows)?;
        let row_px = row_px(width) as usize;
        Ok(Rgb::from_fn(width, height, |x, y| {
            let [red, green, blue, _] = rows[y as usize * row_px + x as usize];
            [red, green, blue]
        }))
    }
}

/// Pixels from one row to the next.
fn row_px(width: u32) -> u32 {
    width.next_multiple_of(ROW_ALIGNMENT_PX)
}
