//! Finding the images of a data set and putting them in order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::{Eye, Pose, Rectification};

use crate::{Calibration, EncodedImage, ImageFormat, RecordingError, encoded_image::size_px};

/// The files of a folder by the part of their names before the last dot.
pub(super) type ByStem = BTreeMap<Stem, PathBuf>;

/// Where data sets have their left images.
const LEFT_FOLDERS: [&str; 6] = ["left", "image_l", "image_0", "images", "Left_rectified", "."];

/// A file name that orders as people count: runs of digits by value, so `2` comes before `10`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Stem {
    parts: Vec<Part>,
    text: String,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Number(u64),
    Text(String),
}

impl Stem {
    pub fn new(text: &str) -> Self {
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let is_digit = first.is_ascii_digit();
            let end = rest.find(|c: char| c.is_ascii_digit() != is_digit).unwrap_or(rest.len());
            let (run, after) = rest.split_at(end);
            parts.push(run.parse().map_or_else(|_| Part::Text(run.to_owned()), Part::Number));
            rest = after;
        }
        Self { parts, text: text.to_owned() }
    }

    /// The name.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The number that the name is, or ends with.
    pub fn number(&self) -> Option<u64> {
        match self.parts.last() {
            Some(Part::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// The first number in the name.
    pub fn first_number(&self) -> Option<u64> {
        self.parts.iter().find_map(|part| match part {
            Part::Number(number) => Some(*number),
            Part::Text(_) => None,
        })
    }
}

/// The images in a folder, in natural order.
pub(super) fn images(folder: &Path) -> Result<ByStem, RecordingError> {
    let mut files = ByStem::new();
    for entry in std::fs::read_dir(folder).map_err(RecordingError::io(folder))? {
        let path = entry.map_err(RecordingError::io(folder))?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).map(Stem::new);
        if let (Some(_), Some(stem)) = (image_format(&path), stem)
            && let Some(other) = files.insert(stem, path.clone())
        {
            return Err(RecordingError::input(&path, format!("{} has the same name", other.display())));
        }
    }
    if files.is_empty() {
        return Err(RecordingError::input(folder, "no JPEG or PNG images in this folder"));
    }
    Ok(files)
}

/// The images with a number at the end of their names, by that number.
pub(super) fn numbered_images(folder: &Path) -> Result<BTreeMap<u64, PathBuf>, RecordingError> {
    images_by(folder, Stem::number, "the name does not end in the frame's number")
}

/// The images of a folder by the number that `number_of` finds in their names; `absent` is said of one without.
pub(super) fn images_by(
    folder: &Path,
    number_of: fn(&Stem) -> Option<u64>,
    absent: &str,
) -> Result<BTreeMap<u64, PathBuf>, RecordingError> {
    let mut files = BTreeMap::new();
    for (stem, path) in images(folder)? {
        let Some(number) = number_of(&stem) else { return Err(RecordingError::input(&path, absent)) };
        if let Some(other) = files.insert(number, path.clone()) {
            return Err(RecordingError::input(&path, format!("{} has the same number", other.display())));
        }
    }
    Ok(files)
}

/// The format that a file's extension tells.
pub(super) fn image_format(path: &Path) -> Option<ImageFormat> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "jpg" | "jpeg" => Some(ImageFormat::Jpeg),
        "png" => Some(ImageFormat::Png),
        _ => None,
    }
}

/// Joins the images of two folders by key; each must have its other.
pub(super) fn pairs<K: Ord>(
    left_folder: &Path,
    left: BTreeMap<K, PathBuf>,
    right_folder: &Path,
    mut right: BTreeMap<K, PathBuf>,
) -> Result<Vec<(K, PathBuf, PathBuf)>, RecordingError> {
    let alone = |path: &Path, folder: &Path, eye| {
        let problem = format!("its {eye} image is missing in {}", folder.display());
        RecordingError::input(path, problem)
    };
    let mut joined = Vec::with_capacity(left.len());
    for (key, left) in left {
        let Some(right) = right.remove(&key) else { return Err(alone(&left, right_folder, "right")) };
        joined.push((key, left, right));
    }
    match right.values().next() {
        Some(path) => Err(alone(path, left_folder, "left")),
        None => Ok(joined),
    }
}

/// Columns and rows that an image file's header claims.
pub(super) fn image_size_px(path: &Path) -> Result<(u32, u32), RecordingError> {
    let format = image_format(path).ok_or_else(|| RecordingError::input(path, "neither JPEG nor PNG"))?;
    let bytes = std::fs::read(path).map_err(RecordingError::io(path))?;
    size_px(&EncodedImage { format, bytes }).map_err(|error| RecordingError::input(path, error))
}

/// Size of the first image that lies where data sets have their left ones; `None` where there is none to be read.
pub(super) fn any_image_size_px(source: &Path) -> Option<(u32, u32)> {
    let folders = LEFT_FOLDERS.map(|name| source.join(name));
    let first = folders.iter().find_map(|folder| images(folder).ok()?.into_values().next())?;
    image_size_px(&first).ok()
}

/// The files of a folder with an extension, in the order of their names.
pub(super) fn with_extension(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, RecordingError> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(RecordingError::io(folder))? {
        let path = entry.map_err(RecordingError::io(folder))?.path();
        if path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension)) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Takes points of the rectified left camera to the left camera itself, for truth that is told of the latter.
pub(super) fn left_from_rectified(calibration: &Calibration) -> Result<Pose, RecordingError> {
    Ok(match calibration {
        Calibration::Rectified(_) => Pose::identity(),
        Calibration::Raw(raw) => {
            Rectification::from_calibration(raw)?.rectified_from_raw(Eye::Left).inverse()
        }
    })
}

/// The stamp of a frame's number at a rate.
pub(super) fn stamp_ns(number: u64, frame_rate_hz: f64) -> u64 {
    (number as f64 * 1e9 / frame_rate_hz).round() as u64
}

/// Reads a text file.
pub(super) fn text(path: &Path) -> Result<String, RecordingError> {
    std::fs::read_to_string(path).map_err(RecordingError::io(path))
}

/// The first of some paths that exists.
pub(super) fn first_existing(
    folder: &Path,
    candidates: &[&str],
    what: &str,
) -> Result<PathBuf, RecordingError> {
    let found = candidates.iter().map(|name| folder.join(name)).find(|path| path.exists());
    found.ok_or_else(|| {
        RecordingError::input(folder, format!("{what} is missing; looked for {}", candidates.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_order_as_people_count() {
        let mut stems = ["101", "1", "51", "1001", "frame_10", "frame_9"].map(Stem::new);
        stems.sort();
        assert_eq!(stems.each_ref().map(Stem::text), ["1", "51", "101", "1001", "frame_9", "frame_10"]);
    }

    #[test]
    fn a_name_gives_the_number_that_it_ends_with() {
        let numbers =
            ["depth_0000012", "7", "a1b", "99999999999999999999999"].map(|name| Stem::new(name).number());
        assert_eq!(numbers, [Some(12), Some(7), None, None]);
    }
}
