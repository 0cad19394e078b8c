//! What surrounds the matching: images up to the GPU, grey values and masks; and from disparities down to depth,
//! its standard deviation, normals and colours.

mod mask;
mod measure_surface;
#[cfg(test)]
mod measure_surface_oracle;
mod prepare;
#[cfg(test)]
mod prepare_oracle;
mod surface;
mod upload;

pub use surface::SurfaceStage;
pub(crate) use upload::Eyes;
pub use upload::{EyeBuffers, Preprocess};

use gpu::KernelDeclaration;

/// The declarations of all kernels of this folder.
pub(crate) fn kernels() -> Vec<KernelDeclaration> {
    vec![prepare::DECLARATION, measure_surface::DECLARATION]
}
