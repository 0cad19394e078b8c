//! Checks that every reader makes.

use crate::RecordingError;
use std::path::Path;

/// Largest image side that is believed.
const SIDE_MAX_PX: f64 = 16_384.0;

/// A side of an image.
pub(super) fn side_px(field: &str, value: f64) -> Result<u32, String> {
    let is_side = (1.0..=SIDE_MAX_PX).contains(&value) && value.fract() == 0.0;
    if is_side { Ok(value as u32) } else { Err(format!("{field} = {value} is no image side in pixels")) }
}

/// Exactly `N` numbers, all finite.
pub(super) fn exactly<const N: usize>(field: &str, values: &[f64]) -> Result<[f64; N], String> {
    let array = <[f64; N]>::try_from(values);
    let array = array.map_err(|_| format!("{field} has {} numbers, not {N}", values.len()))?;
    match array.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(format!("{field} holds {value}")),
        None => Ok(array),
    }
}

/// The numbers of a line of text.
pub(super) fn of_line(field: &str, line: &str) -> Result<Vec<f64>, String> {
    let words =
        line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|word| !word.is_empty());
    words.map(|word| word.parse().map_err(|_| format!("{field}: {word:?} is no number"))).collect()
}

/// A problem of a file.
pub(super) fn of_file<T>(path: &Path, result: Result<T, String>) -> Result<T, RecordingError> {
    result.map_err(|problem| RecordingError::input(path, problem))
}
