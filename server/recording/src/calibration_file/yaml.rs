//! YAML as calibration tools write it, OpenCV's dialect included.

use std::path::Path;

use yaml_rust2::{Yaml, YamlLoader};

use super::numbers::exactly;
use crate::RecordingError;

/// The head that OpenCV writes; YAML itself does not allow it.
const OPENCV_HEAD: &str = "%YAML:1.0";

/// The first document of a file.
pub(super) fn read(path: &Path) -> Result<Yaml, RecordingError> {
    let text = std::fs::read_to_string(path).map_err(RecordingError::io(path))?;
    let text = text.strip_prefix(OPENCV_HEAD).unwrap_or(&text);
    let documents = YamlLoader::load_from_str(text).map_err(|error| RecordingError::input(path, error))?;
    documents.into_iter().next().ok_or_else(|| RecordingError::input(path, "the file is empty"))
}

/// Whether a key is there.
pub(super) fn has(table: &Yaml, key: &str) -> bool {
    !matches!(table[key], Yaml::BadValue)
}

/// Numbers under a key: a list, a list of rows, or the `data` of a matrix.
pub(super) fn numbers(table: &Yaml, key: &str) -> Result<Vec<f64>, String> {
    let value = &table[key];
    let value = if has(value, "data") { &value["data"] } else { value };
    let mut numbers = Vec::new();
    collect(value, key, &mut numbers)?;
    Ok(numbers)
}

fn collect(value: &Yaml, key: &str, numbers: &mut Vec<f64>) -> Result<(), String> {
    match value {
        Yaml::Array(values) => values.iter().try_for_each(|value| collect(value, key, numbers)),
        Yaml::BadValue => Err(format!("{key} is missing")),
        _ => {
            let number = value.as_f64().or_else(|| value.as_i64().map(|value| value as f64));
            numbers.push(number.ok_or_else(|| format!("{key}: {value:?} is no number"))?);
            Ok(())
        }
    }
}

/// Exactly `N` numbers under a key, all finite.
pub(super) fn array<const N: usize>(table: &Yaml, key: &str) -> Result<[f64; N], String> {
    exactly(key, &numbers(table, key)?)
}

/// One number under a key.
pub(super) fn number(table: &Yaml, key: &str) -> Result<f64, String> {
    let [value] = array(table, key)?;
    Ok(value)
}
