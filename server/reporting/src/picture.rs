//! Pictures inside the page: bounded in size, as data addresses.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use geometry::{Raster, Rgb};
use image::RgbImage;
use image::imageops::{self, FilterType};
use recording::{EncodedImage, ImageFormat};

use crate::ReportingError;

/// Widest picture of the page.
const WIDTH_MAX_PX: u32 = 480;
/// Largest side of a result file's picture that is believed.
const SIDE_MAX_PX: u32 = 16_384;
const JPEG_QUALITY: u8 = 82;

/// A picture with what it shows.
pub(crate) struct Picture {
    pub caption: String,
    /// `data:image/jpeg;base64,...`.
    pub address: String,
    pub width_px: u32,
    pub height_px: u32,
}

impl Picture {
    /// Shrinks the picture to the page's width and encodes it.
    ///
    /// # Errors
    /// [`ReportingError::Recording`] where it cannot be encoded.
    pub fn new(caption: String, image: &Rgb) -> Result<Self, ReportingError> {
        let shrunk = shrunk(image);
        let jpeg = recording::encode_jpeg(shrunk.as_ref().unwrap_or(image), JPEG_QUALITY)?;
        let (width_px, height_px) = shrunk.as_ref().unwrap_or(image).size();
        let address = format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg.bytes));
        Ok(Self { caption, address, width_px, height_px })
    }
}

/// Reads a PNG of a run.
///
/// # Errors
/// [`ReportingError`] names the file.
pub(crate) fn read_png(path: &Path) -> Result<Rgb, ReportingError> {
    let bytes = std::fs::read(path).map_err(ReportingError::io(path))?;
    let file = EncodedImage { format: ImageFormat::Png, bytes };
    let damaged = |error| ReportingError::damaged(path, error);
    let (width, height) = recording::size_px(&file).map_err(damaged)?;
    if width.max(height) > SIDE_MAX_PX {
        return Err(ReportingError::damaged(
            path,
            format!("{width}x{height} pixels are no picture of a run"),
        ));
    }
    recording::decode_rgb(&file, (width, height)).map_err(damaged)
}

/// `None` where the image is small enough.
fn shrunk(image: &Rgb) -> Option<Rgb> {
    let (width, height) = image.size();
    if width <= WIDTH_MAX_PX {
        return None;
    }
    let height_px = (u64::from(height) * u64::from(WIDTH_MAX_PX) / u64::from(width)).max(1) as u32;
    let bytes = image.pixels().as_flattened().to_vec();
    let full = RgbImage::from_raw(width, height, bytes).expect("a raster has all its pixels");
    let small = imageops::resize(&full, WIDTH_MAX_PX, height_px, FilterType::Triangle);
    Some(Raster::from_fn(WIDTH_MAX_PX, height_px, |x, y| small.get_pixel(x, y).0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_pictures_are_shrunk_and_keep_their_shape() {
        let wide = Raster::filled(1920, 1080, [10, 200, 30]);
        let picture = Picture::new("wide".into(), &wide).unwrap();
        assert_eq!((picture.width_px, picture.height_px), (480, 270));
        assert!(picture.address.starts_with("data:image/jpeg;base64,/9j/"));
        let small = Picture::new("small".into(), &Raster::filled(64, 48, [0; 3])).unwrap();
        assert_eq!((small.width_px, small.height_px), (64, 48));
    }
}
