//! Pictures of the model from any pose, for reports and thumbnails.

mod shade;
#[cfg(test)]
mod shade_oracle;

use geometry::{DepthMap, Rgb};
use gpu::{FrameRecorder, Gpu, KernelDeclaration, StageTimer};

use shade::ShadeSettings;

use crate::fusion::RESULTS;
use crate::index_map::{IndexMap, SplatSettings};
use crate::store::{Surfel, SurfelRows, SurfelStore};
use crate::view::View;
use crate::{DenseError, model};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 1] = [shade::DECLARATION];

/// Largest half width of a disc in a picture, pixels.
const REACH_MAX_PX: f32 = 64.0;

/// What a picture shows where the model does not cover it.
pub const BACKGROUND: [u8; 3] = [18, 18, 22];

/// How a picture of the model is coloured; the numbers are those of `shared/shading.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coloring {
    /// As the tissue looks.
    Colour = 0,
    /// As clay: all shading.
    Shape = 1,
    /// By the direction of the surface, as in normal maps.
    Normal = 2,
    /// By the weight of the measurements behind it, from violet to yellow.
    Confidence = 3,
}

/// Colours, and what they are measured by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paint {
    pub coloring: Coloring,
    /// Weight of a surfel that is as sure as can be.
    pub weight_max: f32,
    pub background: [u8; 3],
}

/// Stages of a picture.
const STAGES: u32 = 3;

/// A picture of the model and the depth of what it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// Shaded colour.
    pub rgb: Rgb,
    /// Depth along the optical axis, metres, 0 where the background shows.
    pub depth: DepthMap,
}

/// Draws the stable surfels among the first `slots` slots as oriented discs.
pub(crate) fn render(
    gpu: &Gpu,
    timer: &StageTimer,
    (store, slots): (&SurfelStore, u32),
    view: &View,
    paint: Paint,
) -> Result<Rendering, DenseError> {
    let (width, height) = (view.pinhole.width_px, view.pinhole.height_px);
    let pixels = model::checked_pixels(width, height)?;
    let view_uniform = gpu.uniform("rendered view", &view.to_gpu())?;
    let Paint { coloring, weight_max, background } = paint;
    let settings = gpu.uniform("shade settings", &ShadeSettings::new(background, coloring, weight_max))?;
    let color = gpu.storage("rendered colour", pixels)?;
    let depth = gpu.storage("rendered depth", pixels)?;
    let counts = gpu.storage("rendered counts", RESULTS)?;
    let map = IndexMap::new(gpu, &view_uniform, store, &counts, pixels)?;
    let shade = shade::bind(gpu, (&view_uniform, &settings), &map.slots, store, (&color, &depth))?;
    let splat =
        SplatSettings { slots, scale: 1, stable_only: 1, reach_max: REACH_MAX_PX, forget_before: 0, tick: 0 };
    let mut frame = FrameRecorder::begin(gpu, timer);
    map.record(gpu, &mut frame, &splat)?;
    frame.stage("shade", |stage| stage.run(&shade, [width, height, 1]))?;
    frame.submit().collect()?;
    let unpack = |packed: u32| {
        let [red, green, blue, _] = packed.to_le_bytes();
        [red, green, blue]
    };
    let rgb = gpu.read(&color)?.into_iter().map(unpack).collect();
    Ok(Rendering {
        rgb: Rgb::from_vec(width, height, rgb).map_err(DenseError::from)?,
        depth: DepthMap::from_vec(width, height, gpu.read(&depth)?).map_err(DenseError::from)?,
    })
}

/// A picture of a model that lies in memory, as of a session that has ended. `weight_max` is the weight of a surfel that
/// is as sure as can be.
///
/// # Errors
/// [`DenseError::TooManyPixels`], [`DenseError::Gpu`].
pub fn render_surfels(
    gpu: &Gpu,
    surfels: &[Surfel],
    view: &View,
    (coloring, weight_max): (Coloring, f32),
) -> Result<Rendering, DenseError> {
    let store = SurfelStore::new(gpu, surfels.len() as u32)?;
    let rows = SurfelRows::of(surfels);
    gpu.write(&store.geometry, 0, &rows.geometry)?;
    gpu.write(&store.orientation, 0, &rows.orientation)?;
    gpu.write(&store.appearance, 0, &rows.appearance)?;
    gpu.write(&store.history, 0, &rows.history)?;
    let timer = StageTimer::new(gpu, STAGES)?;
    let paint = Paint { coloring, weight_max, background: BACKGROUND };
    render(gpu, &timer, (&store, surfels.len() as u32), view, paint)
}
