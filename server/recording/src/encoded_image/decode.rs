//! Bytes to pixels. The header is compared with the expected size before anything of the image's size is allocated.

use std::io::Cursor;

use geometry::{Gray, Raster, Rgb};
use image::codecs::{jpeg::JpegDecoder, png::PngDecoder};
use image::{ColorType, DynamicImage, ImageDecoder, Limits};

use super::{EncodedImage, ImageFormat, RawPixel};
use crate::RecordingError;

/// Room (bytes) for a decoder's own tables and text chunks, beside the pixels.
const DECODER_ROOM_BYTES: u64 = 1 << 20;
/// Bytes of the widest pixel that a decoder gives, 16-bit RGBA.
const WIDEST_PIXEL_BYTES: u64 = 8;
/// The marker that ends a JPEG file.
const JPEG_END: [u8; 2] = [0xff, 0xd9];

/// Decodes a colour or grey image of `expected_px` columns and rows; alpha is dropped, 16 bits become 8.
///
/// # Errors
/// [`RecordingError::ImageSize`] from the header alone, [`RecordingError::ImageData`] for damaged bytes.
pub fn decode_rgb(image: &EncodedImage, expected_px: (u32, u32)) -> Result<Rgb, RecordingError> {
    match image.format {
        ImageFormat::Raw { pixel, row_bytes, .. } => {
            let rows = check_raw(image, expected_px)?.chunks(row_bytes as usize);
            Ok(match pixel {
                RawPixel::Rgb8 => raster(expected_px, rows, |p: [u8; 3]| p),
                RawPixel::Bgr8 => raster(expected_px, rows, |[b, g, r]: [u8; 3]| [r, g, b]),
                RawPixel::Mono8 => raster(expected_px, rows, |[v]: [u8; 1]| [v, v, v]),
            })
        }
        ImageFormat::Jpeg | ImageFormat::Png => {
            let rgb = decode_file(image, expected_px)?.into_rgb8().into_raw();
            Ok(raster(expected_px, packed_rows(&rgb, expected_px.0, 3), |p: [u8; 3]| p))
        }
    }
}

/// Decodes an image of `expected_px` columns and rows to luminance; colour by Rec. 601 as [`Rgb::to_gray`].
///
/// # Errors
/// As [`decode_rgb`].
pub fn decode_gray(image: &EncodedImage, expected_px: (u32, u32)) -> Result<Gray, RecordingError> {
    match image.format {
        ImageFormat::Raw { pixel: RawPixel::Mono8, row_bytes, .. } => {
            let rows = check_raw(image, expected_px)?.chunks(row_bytes as usize);
            Ok(raster(expected_px, rows, |[v]: [u8; 1]| v))
        }
        ImageFormat::Raw { .. } => Ok(decode_rgb(image, expected_px)?.to_gray()),
        ImageFormat::Jpeg | ImageFormat::Png => {
            let decoded = decode_file(image, expected_px)?;
            if !decoded.color().has_color() {
                let luma = decoded.into_luma8().into_raw();
                return Ok(raster(expected_px, packed_rows(&luma, expected_px.0, 1), |[v]: [u8; 1]| v));
            }
            let rgb = decoded.into_rgb8().into_raw();
            Ok(raster(expected_px, packed_rows(&rgb, expected_px.0, 3), |p: [u8; 3]| p).to_gray())
        }
    }
}

/// Decodes a 16-bit grey PNG of `expected_px` columns and rows.
pub(crate) fn decode_gray16(
    image: &EncodedImage,
    expected_px: (u32, u32),
) -> Result<Raster<u16>, RecordingError> {
    let decoded = decode_file(image, expected_px)?;
    if decoded.color() != ColorType::L16 {
        return Err(damaged(
            image,
            format!("{:?} pixels where 16-bit grey ones are needed", decoded.color()),
        ));
    }
    let pixels = decoded.into_luma16().into_raw();
    Ok(Raster::from_fn(expected_px.0, expected_px.1, |x, y| {
        pixels[y as usize * expected_px.0 as usize + x as usize]
    }))
}

/// Columns and rows that the header claims; nothing else is read.
///
/// # Errors
/// [`RecordingError::ImageData`] where the header is damaged.
pub fn size_px(image: &EncodedImage) -> Result<(u32, u32), RecordingError> {
    match image.format {
        ImageFormat::Raw { width, height, .. } => Ok((width, height)),
        ImageFormat::Jpeg => Ok(jpeg(image)?.dimensions()),
        ImageFormat::Png => Ok(png(image)?.dimensions()),
    }
}

fn jpeg(image: &EncodedImage) -> Result<JpegDecoder<Cursor<&[u8]>>, RecordingError> {
    JpegDecoder::new(Cursor::new(image.bytes.as_slice())).map_err(|error| damaged(image, error))
}

fn png(image: &EncodedImage) -> Result<PngDecoder<Cursor<&[u8]>>, RecordingError> {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(DECODER_ROOM_BYTES);
    PngDecoder::with_limits(Cursor::new(image.bytes.as_slice()), limits)
        .map_err(|error| damaged(image, error))
}

fn decode_file(image: &EncodedImage, expected_px: (u32, u32)) -> Result<DynamicImage, RecordingError> {
    if image.format == ImageFormat::Png {
        return decode_with(image, png(image)?, expected_px);
    }
    let decoder = jpeg(image)?;
    check_size(decoder.dimensions(), expected_px)?;
    // The decoder fills what is missing with grey and calls it a success.
    if !image.bytes.windows(2).rev().any(|marker| marker == JPEG_END) {
        return Err(damaged(image, "it ends before its end marker"));
    }
    decode_with(image, decoder, expected_px)
}

fn decode_with(
    image: &EncodedImage,
    mut decoder: impl ImageDecoder,
    expected_px: (u32, u32),
) -> Result<DynamicImage, RecordingError> {
    check_size(decoder.dimensions(), expected_px)?;
    let pixels = u64::from(expected_px.0) * u64::from(expected_px.1);
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(expected_px.0);
    limits.max_image_height = Some(expected_px.1);
    limits.max_alloc = Some(pixels * WIDEST_PIXEL_BYTES + DECODER_ROOM_BYTES);
    decoder.set_limits(limits).map_err(|error| damaged(image, error))?;
    DynamicImage::from_decoder(decoder).map_err(|error| damaged(image, error))
}

/// The rows of a raw image, once its layout is known to fit its bytes.
fn check_raw(image: &EncodedImage, expected_px: (u32, u32)) -> Result<&[u8], RecordingError> {
    let ImageFormat::Raw { width, height, row_bytes, pixel } = image.format else {
        return Ok(&image.bytes);
    };
    check_size((width, height), expected_px)?;
    let used = u64::from(width) * u64::from(pixel.bytes());
    if width == 0 || height == 0 || u64::from(row_bytes) < used {
        return Err(damaged(
            image,
            format!("rows of {row_bytes} bytes hold {width} pixels only from {used}"),
        ));
    }
    let needed = u64::from(row_bytes) * u64::from(height - 1) + used;
    if (image.bytes.len() as u64) < needed {
        return Err(damaged(image, format!("{height} rows of {row_bytes} bytes need {needed}")));
    }
    let end = image.bytes.len().min(row_bytes as usize * height as usize);
    Ok(&image.bytes[..end])
}

fn check_size(got: (u32, u32), expected: (u32, u32)) -> Result<(), RecordingError> {
    if got == expected { Ok(()) } else { Err(RecordingError::ImageSize { expected, got }) }
}

/// Makes a raster of rows whose length was checked: each begins with its pixels of `N` bytes.
fn raster<'a, const N: usize, T>(
    (width, height): (u32, u32),
    rows: impl Iterator<Item = &'a [u8]>,
    pixel: impl Fn([u8; N]) -> T,
) -> Raster<T> {
    let mut data = Vec::with_capacity(width as usize * height as usize);
    for row in rows {
        data.extend(row.as_chunks::<N>().0[..width as usize].iter().map(|&bytes| pixel(bytes)));
    }
    Raster::from_vec(width, height, data).expect("the rows were checked against the size")
}

/// The pixels of a decoded file, row by row.
fn packed_rows(pixels: &[u8], width: u32, pixel_bytes: usize) -> std::slice::Chunks<'_, u8> {
    pixels.chunks(width as usize * pixel_bytes)
}

fn damaged(image: &EncodedImage, problem: impl std::fmt::Display) -> RecordingError {
    RecordingError::ImageData {
        format: image.format.name(),
        bytes: image.bytes.len(),
        problem: problem.to_string(),
    }
}
