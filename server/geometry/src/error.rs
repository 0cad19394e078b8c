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
    /// An image that is not of its camera's size.
    #[error("the {eye} image is {}x{}, its calibration says {}x{}", got.0, got.1, expected.0, expected.1)]
    ImageSize {
        /// `left` or `right`.
        eye: &'static str,
        /// Columns and rows of the calibration.
        expected: (u32, u32),
        /// Columns and rows of the image.
        got: (u32, u32),
    },
    /// A calibration value that no camera has.
    #[error("calibration refused: {field} = {value}, it must be {requirement}")]
    Field {
        /// The value's path, such as `left.fx_px`.
        field: String,
        /// What it was.
        value: f64,
        /// What it must be.
        requirement: String,
    },
    /// The right camera lies on the left one's left.
    #[error(
        "calibration refused: left and right are swapped, baseline_m = {baseline_m} is negative; exchange the eyes"
    )]
    SwappedEyes {
        /// Signed distance of the optical centres along the left camera's x axis.
        baseline_m: f64,
    },
    /// The optical centres are apart by too little or too much.
    #[error(
        "calibration refused: baseline_m is {baseline_mm} mm, outside {min_mm} to {max_mm} mm \
         (set rig.baseline_min_mm and rig.baseline_max_mm for other rigs)"
    )]
    Baseline {
        /// Distance of the optical centres.
        baseline_mm: f64,
        /// Least allowed.
        min_mm: f64,
        /// Most allowed.
        max_mm: f64,
    },
    /// The cameras stand one above the other.
    #[error(
        "calibration refused: right_from_left.translation = ({x_m}, {y_m}, {z_m}) m is not along x; \
         only side-by-side rigs are rectified"
    )]
    NotSideBySide {
        /// Translation, x.
        x_m: f64,
        /// Translation, y.
        y_m: f64,
        /// Translation, z.
        z_m: f64,
    },
    /// A place outside the field of view that the lens model describes.
    #[error("the lens model has no inverse at ({x}, {y}) of the normalised image plane")]
    NotUndistortable {
        /// Normalised image plane, x.
        x: f64,
        /// Normalised image plane, y.
        y: f64,
    },
    /// The views of two cameras have no common part.
    #[error("the rectified views do not overlap: {0}")]
    NoCommonView(String),
}
