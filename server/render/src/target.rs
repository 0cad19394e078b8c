//! What is drawn into.

use gpu::Gpu;

/// The format of depth: 32 bits, as the nearest discs lie a millimetre from others.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A depth buffer of one size.
#[derive(Debug)]
pub struct DepthBuffer {
    view: wgpu::TextureView,
}

impl DepthBuffer {
    /// For a target of this size, columns and rows.
    pub fn new(gpu: &Gpu, size_px: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let texture = texture(gpu, "drawn depth", size_px, (DEPTH_FORMAT, usage));
        Self { view: texture.create_view(&wgpu::TextureViewDescriptor::default()) }
    }
}

/// The colours and depths of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// Where colours go.
    pub color: &'a wgpu::TextureView,
    /// Of the same size.
    pub depth: &'a DepthBuffer,
}

impl Target<'_> {
    /// A pass that begins with nothing but the background.
    pub(crate) fn begin<'pass>(
        &self,
        encoder: &'pass mut wgpu::CommandEncoder,
        background: wgpu::Color,
    ) -> wgpu::RenderPass<'pass> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surfels"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(background), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth.view,
                // Depths are near / z: 0 is infinitely far.
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}

/// A texture of one layer and level.
pub(crate) fn texture(
    gpu: &Gpu,
    label: &str,
    (width, height): (u32, u32),
    (format, usage): (wgpu::TextureFormat, wgpu::TextureUsages),
) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
