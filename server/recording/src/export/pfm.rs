//! Portable float maps with one channel: a text header, then rows of 32-bit floats from the bottom up.
//!
//! Format: <https://www.pauldebevec.com/Research/HDR/PFM/>; a negative scale says little endian.

use std::io::Write;
use std::path::Path;

use geometry::Raster;

use crate::RecordingError;

/// Writes values row by row, little endian, as they are (metres for depth, pixels for disparity).
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_pfm(path: &Path, image: &Raster<f32>) -> Result<(), RecordingError> {
    let mut bytes = Vec::with_capacity(image.pixels().len() * 4 + 32);
    write!(bytes, "Pf\n{} {}\n-1.0\n", image.width(), image.height()).expect("memory takes what is written");
    for y in (0..image.height()).rev() {
        bytes.extend(image.row(y).iter().flat_map(|value| value.to_le_bytes()));
    }
    std::fs::write(path, bytes).map_err(RecordingError::io(path))
}

/// Reads a map of either byte order.
///
/// # Errors
/// [`RecordingError::Io`], or [`RecordingError::Input`] where the header or length is wrong.
pub fn read_pfm(path: &Path) -> Result<Raster<f32>, RecordingError> {
    let bytes = std::fs::read(path).map_err(RecordingError::io(path))?;
    parse(&bytes).map_err(|problem| RecordingError::input(path, problem))
}

fn parse(bytes: &[u8]) -> Result<Raster<f32>, String> {
    let mut rest = bytes;
    let kind = token(&mut rest)?;
    if kind != "Pf" {
        return Err(format!("PFM header begins with {kind:?}, not Pf (one channel)"));
    }
    let mut side = |name| -> Result<u32, String> {
        let text = token(&mut rest)?;
        text.parse().ok().filter(|&side| side > 0).ok_or_else(|| format!("PFM {name} {text:?}"))
    };
    let (width, height) = (side("width")?, side("height")?);
    let scale = token(&mut rest)?;
    let scale: f64 = scale.parse().map_err(|_| format!("PFM scale {scale:?}"))?;
    let row_bytes = u64::from(width) * 4;
    if row_bytes.checked_mul(u64::from(height)) != Some(rest.len() as u64) {
        return Err(format!("PFM of {width}x{height} has {} bytes of pixels", rest.len()));
    }
    let value = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let rows = rest.chunks_exact(row_bytes as usize).rev();
    let values = rows.flat_map(|row| row.as_chunks::<4>().0).map(|&bytes| value(bytes)).collect();
    Raster::from_vec(width, height, values).map_err(|error| error.to_string())
}

/// Takes a word of the header and the one white space after it.
fn token<'a>(rest: &mut &'a [u8]) -> Result<&'a str, String> {
    let end = rest.iter().position(u8::is_ascii_whitespace).ok_or("PFM header ends early")?;
    let (word, after) = rest.split_at(end);
    *rest = &after[1..];
    std::str::from_utf8(word).map_err(|_| "PFM header is no text".to_owned())
}
