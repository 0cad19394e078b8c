//! The index map: which surfel each pixel of a view shows.

mod list_visible;
mod splat_depth;
#[cfg(test)]
mod splat_oracle;
mod splat_slot;
mod visible;
#[cfg(test)]
mod visible_oracle;
mod write_visible;

use bytemuck::{Pod, Zeroable};
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::store::SurfelStore;
use crate::view::GpuView;
pub(crate) use visible::VisibleSurfels;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 4] = [
    list_visible::DECLARATION,
    write_visible::DECLARATION,
    splat_depth::DECLARATION,
    splat_slot::DECLARATION,
];

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
    /// Unstable surfels last seen before this frame are deleted.
    pub forget_before: u32,
    /// Frames that the model has taken so far.
    pub tick: u32,
}

/// An index map of one view's size, bound to a store.
#[derive(Debug)]
pub(crate) struct IndexMap {
    settings: GpuBuffer<SplatSettings>,
    nearest: GpuBuffer<u32>,
    /// Per cell: the inverted slot of the surfel it shows, 0 where none.
    pub slots: GpuBuffer<u32>,
    /// What lies in the view.
    pub visible: VisibleSurfels,
    passes: [BoundKernel; 2],
}

impl IndexMap {
    /// A map of `cells` cells for `view` over `store`, whose scratch it uses; counts deleted surfels in `results`.
    pub fn new(
        gpu: &Gpu,
        view: &GpuBuffer<GpuView>,
        store: &SurfelStore,
        results: &GpuBuffer<u32>,
        cells: usize,
    ) -> Result<Self, GpuError> {
        let settings = gpu.uniform("splat settings", &SplatSettings::zeroed())?;
        let nearest = gpu.storage("index map nearest", cells)?;
        let slots = gpu.storage("index map slots", cells)?;
        let visible = VisibleSurfels::new(gpu, (view, &settings), store, results)?;
        let depth = splat_depth::bind(gpu, (view, &settings), store, &visible, &nearest)?;
        let slot = splat_slot::bind(gpu, (view, &settings), (&visible, &store.scratch), (&nearest, &slots))?;
        Ok(Self { settings, nearest, slots, visible, passes: [depth, slot] })
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
        frame.stage("visible", |stage| self.visible.record(gpu, stage, settings.slots))?;
        frame.stage("index map", |stage| {
            self.passes.iter().try_for_each(|pass| stage.run_indirect(pass, &self.visible.groups))
        })
    }
}
