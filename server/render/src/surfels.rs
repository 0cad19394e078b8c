//! The arrays that surfels are drawn from.

use gpu::{Gpu, GpuBuffer, GpuError};

/// State bits of a surfel that is shown: alive and stable (`shared/surfel.wgsl`).
const SHOWN: u32 = 3;

/// Handles to the arrays of a model, one row of 16 bytes per slot and array (`shared/surfel.wgsl`).
#[derive(Clone, Debug)]
pub struct SurfelArrays {
    /// Position in world (m), radius (m).
    pub geometry: GpuBuffer<[f32; 4]>,
    /// Unit normal in world, weight.
    pub orientation: GpuBuffer<[f32; 4]>,
    /// Red, green, blue (0-255), colour weight.
    pub appearance: GpuBuffer<[f32; 4]>,
    /// Id, frame last seen, frame created, state bits.
    pub history: GpuBuffer<[u32; 4]>,
    /// Slots in use.
    pub slots: u32,
}

/// One surfel to be uploaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfelRow {
    /// Centre in the world, metres.
    pub position_in_world_m: [f32; 3],
    /// Unit length.
    pub normal_in_world: [f32; 3],
    /// Radius of the disc.
    pub radius_m: f32,
    /// sRGB.
    pub color: [u8; 3],
    /// Weight; what is as sure as can be is [`crate::Style::weight_max`].
    pub weight: f32,
}

/// Arrays of a viewer's own, which grow with the model.
#[derive(Debug)]
pub struct SurfelUpload {
    arrays: SurfelArrays,
}

impl SurfelUpload {
    /// Room for no surfel yet.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self { arrays: arrays(gpu, 1)? })
    }

    /// Shows these from the next frame on.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`], [`GpuError::OutOfMemory`].
    pub fn replace(&mut self, gpu: &Gpu, surfels: &[SurfelRow]) -> Result<(), GpuError> {
        if surfels.len() > self.arrays.geometry.len() {
            self.arrays = arrays(gpu, surfels.len().next_power_of_two())?;
        }
        let (mut geometry, mut orientation, mut appearance, mut history) = (
            Vec::with_capacity(surfels.len()),
            Vec::with_capacity(surfels.len()),
            Vec::with_capacity(surfels.len()),
            Vec::with_capacity(surfels.len()),
        );
        for surfel in surfels {
            let ([x, y, z], [nx, ny, nz]) = (surfel.position_in_world_m, surfel.normal_in_world);
            let [red, green, blue] = surfel.color.map(f32::from);
            geometry.push([x, y, z, surfel.radius_m]);
            orientation.push([nx, ny, nz, surfel.weight]);
            appearance.push([red, green, blue, 1.0]);
            history.push([0, 0, 0, SHOWN]);
        }
        gpu.write(&self.arrays.geometry, 0, &geometry)?;
        gpu.write(&self.arrays.orientation, 0, &orientation)?;
        gpu.write(&self.arrays.appearance, 0, &appearance)?;
        gpu.write(&self.arrays.history, 0, &history)?;
        self.arrays.slots = surfels.len() as u32;
        Ok(())
    }

    /// What is to be drawn.
    pub fn arrays(&self) -> &SurfelArrays {
        &self.arrays
    }
}

fn arrays(gpu: &Gpu, slots: usize) -> Result<SurfelArrays, GpuError> {
    Ok(SurfelArrays {
        geometry: gpu.storage("drawn geometry", slots)?,
        orientation: gpu.storage("drawn orientation", slots)?,
        appearance: gpu.storage("drawn appearance", slots)?,
        history: gpu.storage("drawn history", slots)?,
        slots: 0,
    })
}
