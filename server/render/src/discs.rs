//! The pipeline of `discs.wgsl`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use geometry::{Pinhole, Pose};
use gpu::{Gpu, GpuBuffer, GpuError};

use crate::surfels::SurfelArrays;
use crate::target::{DEPTH_FORMAT, Target};

const WGSL: &str = include_str!("discs.wgsl");
/// Two triangles.
const VERTICES_PER_SURFEL: u32 = 6;
/// Views in one frame: one for each eye.
const EYES_MAX: usize = 2;
/// Nothing nearer to the eye is drawn.
const NEAR_M: f32 = 1e-4;

/// How surfels are coloured; the numbers are those of `shared/shading.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coloring {
    /// As the tissue looks.
    Colour = 0,
    /// As clay: all shading.
    Shape = 1,
    /// By the direction of the surface, as in normal maps.
    Normal = 2,
    /// By weight, from violet to yellow.
    Confidence = 3,
}

/// What all surfels of a frame have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// How they are coloured.
    pub coloring: Coloring,
    /// Weight of a surfel that is as sure as can be.
    pub weight_max: f32,
    /// Share of the way to grey and dark, 0 to 1: how stale the model is.
    pub fade: f32,
    /// sRGB of what no surfel covers.
    pub background: [u8; 3],
}

/// A part of the target, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Viewport {
    /// Its left edge.
    pub x: u32,
    /// Its upper edge.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A camera, and the part of the target that shows its whole image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// The camera; its image is stretched to the viewport.
    pub pinhole: Pinhole,
    /// Maps camera points to world points.
    pub world_from_camera: Pose,
    /// Where its image goes.
    pub viewport: Viewport,
}

/// `Scene` of `discs.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Scene {
    camera_from_world: [[f32; 4]; 3],
    clip_from_ray: [f32; 4],
    background: [f32; 4],
    near_m: f32,
    weight_max: f32,
    fade: f32,
    coloring: u32,
}

impl Scene {
    fn new(eye: &Eye, style: &Style) -> Self {
        let camera_from_world = eye.world_from_camera.inverse().to_homogeneous();
        let [red, green, blue] = style.background.map(f32::from);
        Self {
            camera_from_world: [0, 1, 2]
                .map(|row| [0, 1, 2, 3].map(|column| camera_from_world[(row, column)] as f32)),
            clip_from_ray: clip_from_ray(&eye.pinhole),
            background: [red, green, blue, 255.0],
            near_m: NEAR_M,
            weight_max: style.weight_max,
            fade: style.fade,
            coloring: style.coloring as u32,
        }
    }
}

/// Pixel centres are at integers, so the image reaches from -0.5 to its side less 0.5; clip space has y up.
fn clip_from_ray(pinhole: &Pinhole) -> [f32; 4] {
    let (width, height) = (f64::from(pinhole.width_px), f64::from(pinhole.height_px));
    [
        2.0 * pinhole.fx_px / width,
        -2.0 * pinhole.fy_px / height,
        2.0 * (pinhole.cx_px + 0.5) / width - 1.0,
        1.0 - 2.0 * (pinhole.cy_px + 0.5) / height,
    ]
    .map(|value| value as f32)
}

/// Draws discs into targets of one format.
#[derive(Debug)]
pub struct DiscRenderer {
    gpu: Arc<Gpu>,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    scenes: [GpuBuffer<Scene>; EYES_MAX],
}

impl DiscRenderer {
    /// Compiles the shaders. `format` is without sRGB conversion: colours are sRGB already.
    ///
    /// # Errors
    /// [`GpuError::Validation`] of a device that does not take them.
    pub fn new(gpu: Arc<Gpu>, format: wgpu::TextureFormat) -> Result<Self, GpuError> {
        let layout = gpu.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("discs"),
            entries: &[0, 1, 2, 3, 4].map(layout_entry),
        });
        let pipeline = pipeline(&gpu, &layout, format)?;
        let empty = Scene::zeroed();
        let scenes = [gpu.uniform("scene", &empty)?, gpu.uniform("scene of the right eye", &empty)?];
        gpu.health()?;
        Ok(Self { gpu, pipeline, layout, scenes })
    }

    /// Records a frame: background, then the surfels as each eye sees them. One frame is recorded per submission.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: Target,
        (eyes, style): (&[Eye], &Style),
        surfels: &SurfelArrays,
    ) -> Result<(), GpuError> {
        let [red, green, blue] = style.background.map(|level| f64::from(level) / 255.0);
        let mut pass = target.begin(encoder, wgpu::Color { r: red, g: green, b: blue, a: 1.0 });
        pass.set_pipeline(&self.pipeline);
        for (eye, scene) in eyes.iter().zip(&self.scenes) {
            self.gpu.write(scene, 0, &[Scene::new(eye, style)])?;
            let Viewport { x, y, width, height } = eye.viewport;
            pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
            pass.set_bind_group(0, &self.bind(scene, surfels), &[]);
            pass.draw(0..surfels.slots * VERTICES_PER_SURFEL, 0..1);
        }
        Ok(())
    }

    fn bind(&self, scene: &GpuBuffer<Scene>, surfels: &SurfelArrays) -> wgpu::BindGroup {
        let SurfelArrays { geometry, orientation, appearance, history, .. } = surfels;
        let buffers = [scene.raw(), geometry.raw(), orientation.raw(), appearance.raw(), history.raw()];
        let entries: Vec<_> = buffers
            .iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        self.gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("discs"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

/// Binding 0 is the scene, the others are the arrays.
fn layout_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let (visibility, ty) = if binding == 0 {
        (wgpu::ShaderStages::VERTEX_FRAGMENT, wgpu::BufferBindingType::Uniform)
    } else {
        (wgpu::ShaderStages::VERTEX, wgpu::BufferBindingType::Storage { read_only: true })
    };
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

fn pipeline(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    format: wgpu::TextureFormat,
) -> Result<wgpu::RenderPipeline, GpuError> {
    let source = gpu::resolve_imports(WGSL).map_err(GpuError::Validation)?;
    let device = gpu.device();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("discs"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("discs"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    Ok(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("discs"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("place_corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("shade_disc"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    }))
}
