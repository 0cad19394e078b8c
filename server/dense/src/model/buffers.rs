//! The buffers that the stages of a frame share.

use geometry::StereoRig;
use gpu::{Gpu, GpuBuffer, PrefixSum};

use crate::config::DenseConfig;
use crate::fusion::{FusionSettings, RESULTS};
use crate::index_map::IndexMap;
use crate::store::SurfelStore;
use crate::tone::Tone;
use crate::view::GpuView;
use crate::{DenseError, Observation, View};

/// The largest number of pixels that a claim key can hold.
const PIXEL_LIMIT: u32 = 1 << 23;

/// What a frame reads and writes besides its own stages' scratch.
#[derive(Debug)]
pub(crate) struct FrameBuffers {
    pub observation: Observation,
    pub store: SurfelStore,
    pub view: GpuBuffer<GpuView>,
    pub settings: GpuBuffer<FusionSettings>,
    pub index_scale: GpuBuffer<u32>,
    pub index_map: IndexMap,
    /// Counts, verdict and error histogram; places in `shared/fusion.wgsl`.
    pub results: GpuBuffer<u32>,
    /// One bit per pixel: a registered surfel is near.
    pub covered: GpuBuffer<u32>,
    /// Claims on the cells of the point grid.
    pub claims: GpuBuffer<u32>,
    /// Pixels to lift.
    pub lifted: PrefixSum,
    /// Brightness of the frame against the model.
    pub tone: GpuBuffer<Tone>,
}

impl FrameBuffers {
    /// Buffers for frames like `observation` over `store`.
    pub fn new(
        gpu: &Gpu,
        rig: &StereoRig,
        observation: &Observation,
        store: SurfelStore,
        config: &DenseConfig,
    ) -> Result<Self, DenseError> {
        let pixels = checked_pixels(observation.width, observation.height)?;
        let scale = config.index_map_scale;
        let standing = View { pinhole: rig.left, world_from_camera: geometry::Pose::identity() };
        let view = gpu.uniform("view", &standing.to_gpu())?;
        let results = gpu.storage("results", RESULTS)?;
        let index_map = IndexMap::new(gpu, &view, &store, &results, pixels * (scale * scale) as usize)?;
        let places = claim_places(pixels);
        Ok(Self {
            observation: observation.clone(),
            view,
            settings: gpu
                .uniform("fusion settings", &FusionSettings::new(config, focal_baseline(rig), places))?,
            index_scale: gpu.uniform("index map scale", &scale)?,
            index_map,
            results,
            covered: gpu.storage("covered", pixels.div_ceil(32))?,
            claims: gpu.storage("claims", places as usize)?,
            lifted: PrefixSum::new(gpu, pixels)?,
            tone: gpu.uniform("tone", &Tone::UNKNOWN)?,
            store,
        })
    }
}

/// Focal length times baseline, px m.
pub(crate) fn focal_baseline(rig: &StereoRig) -> f64 {
    rig.left.fx_px * rig.baseline_m
}

/// Places in the claim table: a power of two, so many that most cells have one to themselves.
pub(crate) fn claim_places(pixels: usize) -> u32 {
    (pixels as u32).next_power_of_two()
}

/// Pixels of an image, refused where keys could not number them.
pub(crate) fn checked_pixels(width: u32, height: u32) -> Result<usize, DenseError> {
    match width.checked_mul(height) {
        Some(pixels) if pixels <= PIXEL_LIMIT => Ok(pixels as usize),
        _ => Err(DenseError::TooManyPixels { width, height, limit: PIXEL_LIMIT }),
    }
}
