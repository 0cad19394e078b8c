//! Pictures of the model from any pose, for reports and thumbnails.

mod shade;
#[cfg(test)]
mod shade_oracle;

use geometry::{DepthMap, Rgb};
use gpu::{FrameRecorder, Gpu, KernelDeclaration, StageTimer};

use crate::fusion::RESULTS;
use crate::index_map::{IndexMap, SplatSettings};
use crate::store::SurfelStore;
use crate::view::View;
use crate::{DenseError, model};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 1] = [shade::DECLARATION];

/// Largest half width of a disc in a picture, pixels.
const REACH_MAX_PX: f32 = 64.0;

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
    background: [u8; 3],
) -> Result<Rendering, DenseError> {
    let (width, height) = (view.pinhole.width_px, view.pinhole.height_px);
    let pixels = model::checked_pixels(width, height)?;
    let [red, green, blue] = background;
    let view_uniform = gpu.uniform("rendered view", &view.to_gpu())?;
    let background = gpu.uniform("background", &u32::from_le_bytes([red, green, blue, 0xFF]))?;
    let color = gpu.storage("rendered colour", pixels)?;
    let depth = gpu.storage("rendered depth", pixels)?;
    let counts = gpu.storage("rendered counts", RESULTS)?;
    let map = IndexMap::new(gpu, &view_uniform, store, &counts, pixels)?;
    let shade = shade::bind(gpu, (&view_uniform, &background), &map.slots, store, (&color, &depth))?;
    let settings =
        SplatSettings { slots, scale: 1, stable_only: 1, reach_max: REACH_MAX_PX, forget_before: 0, tick: 0 };
    let mut frame = FrameRecorder::begin(gpu, timer);
    map.record(gpu, &mut frame, &settings)?;
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
