//! Brightness of a frame against the model, so that the model's colours are those under even light.
//!
//! A scope carries its lamp: what is near and faces it is bright, and the camera adapts its exposure besides. Averaged as
//! they come, the colours of neighbouring parts seen from different places do not match: the seams that the paper calls its
//! biggest problem. So fusion takes out of each pixel the fall-off of light at its place, `cos / d^2`, and the frame's gain
//! and bias, fitted here to the colours that the model already has.

mod fit_tone;
mod sample_tone;
#[cfg(test)]
pub(crate) mod tone_oracle;

use bytemuck::{Pod, Zeroable};
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 2] = [sample_tone::DECLARATION, fit_tone::DECLARATION];

/// Invocations of `sample_tone`.
const INVOCATIONS: u32 = 256;

/// `Tone` of `shared/light.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Tone {
    /// Red, green, blue; 1 once it was fitted.
    pub gain: [f32; 4],
    /// Red, green, blue, levels.
    pub bias: [f32; 4],
}

impl Tone {
    /// Before any frame.
    pub const UNKNOWN: Self = Self { gain: [1.0, 1.0, 1.0, 0.0], bias: [0.0; 4] };
}

/// The fit, bound to a frame's buffers.
#[derive(Debug)]
pub(crate) struct ToneFit {
    sample: BoundKernel,
    fit: BoundKernel,
    fitted: GpuBuffer<Tone>,
}

impl ToneFit {
    pub fn new(gpu: &Gpu, frame: &FrameBuffers) -> Result<Self, GpuError> {
        let sums = gpu.storage("tone sums", 4 * INVOCATIONS as usize)?;
        let fitted = gpu.storage_from("fitted tone", &[Tone::UNKNOWN])?;
        let (sample, fit) = (sample_tone::bind(gpu, frame, &sums)?, fit_tone::bind(gpu, &sums, &fitted)?);
        Ok(Self { sample, fit, fitted })
    }

    /// Takes over what was fitted before the arrays grew.
    pub fn copy_from(&self, frame: &mut FrameRecorder, before: &Self) -> Result<(), GpuError> {
        frame.copy(&before.fitted, &self.fitted, 1)
    }

    /// Records the fit of the frame's tone to the model that the index map shows: 2 dispatches.
    pub fn record(&self, frame: &mut FrameRecorder, buffers: &FrameBuffers) -> Result<(), GpuError> {
        frame.stage("tone", |stage| {
            stage.run(&self.sample, [INVOCATIONS, 1, 1])?;
            stage.run(&self.fit, [1, 1, 1])
        })?;
        frame.copy(&self.fitted, &buffers.tone, 1)
    }
}
