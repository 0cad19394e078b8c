//! The crate's errors.

use gpu::GpuError;

/// What stops the dense model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DenseError {
    /// The device refused or is lost.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// An image whose pixels do not fill it; cannot happen to rasters made here.
    #[error(transparent)]
    Geometry(#[from] geometry::GeometryError),
    /// An image that does not fit the rig.
    #[error("the {what} image has {}x{} pixels, the rig {}x{}", found.0, found.1, expected.0, expected.1)]
    ImageSize {
        /// Which image.
        what: &'static str,
        /// Columns, rows of the image.
        found: (u32, u32),
        /// Columns, rows of the rig.
        expected: (u32, u32),
    },
    /// A value of the configuration that cannot be used.
    #[error("{field} = {value} must be {requirement}")]
    Config {
        /// Full name of the option.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// A camera with more pixels than the model can address.
    #[error("a camera of {width}x{height} has more than {limit} pixels")]
    TooManyPixels {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// The most.
        limit: u32,
    },
}
