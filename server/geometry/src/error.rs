//! The crate's errors.

/// What can be wrong with cameras, rigs, images and trajectories.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// The pixels do not fill the image.
    #[error("an image of {width}x{height} needs {} pixels, got {pixels}", *width as usize * *height as usize)]
    RasterSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
}
