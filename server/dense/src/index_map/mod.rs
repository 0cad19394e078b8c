//! The index map: which surfel each pixel of a view shows.

mod splat_depth;
#[cfg(test)]
mod splat_oracle;
mod splat_slot;

use bytemuck::{Pod, Zeroable};
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::store::{Bits, SurfelStore};
use crate::view::GpuView;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 2] = [splat_depth::DECLARATION, splat_slot::DECLARATION];

/// `SplatSettings` of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SplatSettings {
    /// Slots in use.
    pub slots: u32,
    /// Cells per pixel and axis.
    pub scale: u32,
    /// 1 to leave out surfels that are not stable.
    pub stable_only: u32,
    /// Largest half width of a disc, cells.
    pub reach_max: f32,
}

/// An index map of one view's size, bound to a store.
#[derive(Debug)]
pub(crate) struct IndexMap {
    settings: GpuBuffer<SplatSettings>,
    nearest: GpuBuffer<u32>,
    /// Per cell: the inverted slot of the surfel it shows, 0 where none.
    pub slots: GpuBuffer<u32>,
    passes: [BoundKernel; 2],
}

impl IndexMap {
    /// A map of `cells` cells for `view` over `store`.
    pub fn new(
        gpu: &Gpu,
        view: &GpuBuffer<GpuView>,
        store: &SurfelStore,
        cells: usize,
    ) -> Result<Self, GpuError> {
        let settings = gpu.uniform("splat settings", &SplatSettings::zeroed())?;
        let nearest = gpu.storage("index map nearest", cells)?;
        let slots = gpu.storage("index map slots", cells)?;
        let footprints: GpuBuffer<Bits> = gpu.storage("footprints", store.capacity() as usize)?;
        let depth = splat_depth::bind(gpu, view, &settings, store, (&nearest, &footprints))?;
        let slot = splat_slot::bind(gpu, (view, &settings), &footprints, (&nearest, &slots))?;
        Ok(Self { settings, nearest, slots, passes: [depth, slot] })
    }

    /// Records the projection; one setting holds for a whole submission.
    pub fn record(
        &self,
        gpu: &Gpu,
        frame: &mut FrameRecorder,
        settings: &SplatSettings,
    ) -> Result<(), GpuError> {
        gpu.write(&self.settings, 0, std::slice::from_ref(settings))?;
        frame.clear(&self.nearest);
        frame.clear(&self.slots);
        frame.stage("index map", |stage| {
            self.passes.iter().try_for_each(|pass| stage.run(pass, [settings.slots, 1, 1]))
        })
    }
}
