//! The pipeline of `overlay.wgsl`: pictures of text over what is drawn.

use std::sync::Arc;

use gpu::{Gpu, GpuBuffer, GpuError};

use crate::Viewport;
use crate::target::texture;

/// A picture on the GPU that is laid over frames.
#[derive(Debug)]
pub struct Overlay {
    size_px: (u32, u32),
    view: wgpu::TextureView,
}

impl Overlay {
    /// Of rows of red, green, blue (sRGB) and opacity.
    ///
    /// # Errors
    /// [`GpuError::Validation`] where the pixels do not fill the size or the device does not take it.
    pub fn new(gpu: &Gpu, size_px: (u32, u32), rgba: &[[u8; 4]]) -> Result<Self, GpuError> {
        let (width, height) = size_px;
        if rgba.len() != width as usize * height as usize || rgba.is_empty() {
            let text = format!("an overlay of {width}x{height} pixels has {}", rgba.len());
            return Err(GpuError::Validation(text));
        }
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = texture(gpu, "overlay", size_px, (wgpu::TextureFormat::Rgba8Unorm, usage));
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 4), rows_per_image: None };
        gpu.queue().write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(rgba),
            layout,
            texture.size(),
        );
        gpu.health()?;
        Ok(Self { size_px, view: texture.create_view(&wgpu::TextureViewDescriptor::default()) })
    }

    /// Columns, rows.
    pub fn size_px(&self) -> (u32, u32) {
        self.size_px
    }
}

/// Lays overlays over targets of one format.
#[derive(Debug)]
pub struct OverlayRenderer {
    gpu: Arc<Gpu>,
    pipeline: wgpu::RenderPipeline,
    smoothing: wgpu::Sampler,
}

impl OverlayRenderer {
    /// Compiles the shaders.
    ///
    /// # Errors
    /// [`GpuError::Validation`] of a device that does not take them.
    pub fn new(gpu: Arc<Gpu>, format: wgpu::TextureFormat) -> Result<Self, GpuError> {
        let pipeline = pipeline(gpu.device(), format);
        let smoothing = gpu.device().create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        gpu.health()?;
        Ok(Self { gpu, pipeline, smoothing })
    }

    /// Records an overlay into rectangles of a target of `target_px`, over what is there.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`].
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (target, target_px): (&wgpu::TextureView, (u32, u32)),
        overlay: &Overlay,
        places: &[Viewport],
    ) -> Result<(), GpuError> {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("overlay"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        for place in places {
            let place = self.gpu.uniform("overlay place", &in_clip(place, target_px))?;
            pass.set_bind_group(0, &self.bind(&place, overlay), &[]);
            pass.draw(0..4, 0..1);
        }
        Ok(())
    }

    fn bind(&self, place: &GpuBuffer<[f32; 4]>, overlay: &Overlay) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        self.gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("overlay"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                entry(0, place.raw().as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&overlay.view)),
                entry(2, wgpu::BindingResource::Sampler(&self.smoothing)),
            ],
        })
    }
}

/// Left, top, right, bottom.
fn in_clip(place: &Viewport, (width, height): (u32, u32)) -> [f32; 4] {
    let x = |at: u32| at as f32 / width as f32 * 2.0 - 1.0;
    let y = |at: u32| 1.0 - at as f32 / height as f32 * 2.0;
    [x(place.x), y(place.y), x(place.x + place.width), y(place.y + place.height)]
}

fn pipeline(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("overlay"),
        source: wgpu::ShaderSource::Wgsl(include_str!("overlay.wgsl").into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("overlay"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("place_overlay"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("shade_overlay"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
