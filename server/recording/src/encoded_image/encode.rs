//! Pixels to bytes.

use geometry::{Gray, Rgb};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use super::{EncodedImage, ImageFormat};
use crate::RecordingError;

/// Encodes as JPEG of `quality` 1 to 100, colours at full resolution.
///
/// # Errors
/// [`RecordingError::ImageData`] for an image without pixels or with a side of more than 65535.
pub fn encode_jpeg(image: &Rgb, quality: u8) -> Result<EncodedImage, RecordingError> {
    let format = ImageFormat::Jpeg;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    let (width, height) = image.size();
    let side = |px| u16::try_from(px).map_err(|_| failed(format, format!("{width}x{height} is too large")));
    encoder
        .encode(image.pixels().as_flattened(), side(width)?, side(height)?, ColorType::Rgb)
        .map_err(|error| failed(format, error))?;
    Ok(EncodedImage { format, bytes })
}

/// Encodes as PNG.
///
/// # Errors
/// [`RecordingError::ImageData`] for an image without pixels.
pub fn encode_png_rgb(image: &Rgb) -> Result<EncodedImage, RecordingError> {
    encode_png(image.pixels().as_flattened(), image.size(), ExtendedColorType::Rgb8)
}

/// Encodes luminance or a mask as PNG.
///
/// # Errors
/// [`RecordingError::ImageData`] for an image without pixels.
pub fn encode_png_gray(image: &Gray) -> Result<EncodedImage, RecordingError> {
    encode_png(image.pixels(), image.size(), ExtendedColorType::L8)
}

fn encode_png(
    pixels: &[u8],
    (width, height): (u32, u32),
    color: ExtendedColorType,
) -> Result<EncodedImage, RecordingError> {
    let format = ImageFormat::Png;
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(pixels, width, height, color)
        .map_err(|error| failed(format, error))?;
    Ok(EncodedImage { format, bytes })
}

fn failed(format: ImageFormat, problem: impl std::fmt::Display) -> RecordingError {
    RecordingError::ImageData { format: format.name(), bytes: 0, problem: problem.to_string() }
}
