//! Recordings (MCAP), data-set importers and result files.
//!
//! Images are copied as the bytes they came in; they are decoded at one place, [`decode_rgb`] and [`decode_gray`],
//! and only once their header is known to fit the calibration.

mod calibration;
mod calibration_file;
mod config;
mod encoded_image;
mod error;
pub mod export;
pub mod import;
mod pairing;
mod reader;
mod rig_file;
mod rotation;
mod schema;
mod source;
mod truth;
mod wire;
mod writer;

pub use calibration::Calibration;
pub use calibration_file::{CalibrationHints, read_calibration};
pub use config::{Compression, RecordingConfig, Topics};
pub use encoded_image::{
    EncodedImage, ImageFormat, RawPixel, decode_gray, decode_rgb, encode_jpeg, encode_png_gray,
    encode_png_rgb, size_px,
};
pub use error::RecordingError;
pub use pairing::{PairingStatistics, StereoMessage};
pub use reader::{RecordingReader, StereoMessages};
pub use rig_file::RigFile;
pub use truth::{StampedDepth, TruthPoints};
pub use writer::RecordingWriter;
