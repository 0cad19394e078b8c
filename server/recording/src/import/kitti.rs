//! KITTI odometry: `calib.txt` with the projections of the rectified cameras, `poses.txt` with one 3x4
//! `world_from_camera` a line, images named by their index.
//!
//! Also read are the benchmark's own names: `image_0` and `image_1` or `image_2` and `image_3`, `calib.txt` with
//! `P0:` to `P3:`, and `times.txt` in seconds.

use std::path::Path;

use geometry::{Pinhole, Pose, StereoRig};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

use super::{Plan, PlannedFrame, files};
use crate::encoded_image::size_px;
use crate::{Calibration, EncodedImage, RecordingError, RigFile};

/// Rate of the recording cameras where there is no `times.txt`.
const FRAME_RATE_HZ: f64 = 10.0;
const FOLDERS: [(&str, &str, [usize; 2]); 3] =
    [("image_l", "image_r", [0, 1]), ("image_2", "image_3", [2, 3]), ("image_0", "image_1", [0, 1])];
/// Digits of an exponent, after its sign.
const EXPONENT_DIGITS: usize = 2;

pub(super) fn plan(source: &Path, rig: Option<RigFile>) -> Result<Plan, RecordingError> {
    let (left, right, cameras) = FOLDERS
        .into_iter()
        .find(|(left, ..)| source.join(left).is_dir())
        .ok_or_else(|| RecordingError::input(source, "no image_l, image_2 or image_0 folder"))?;
    let (left, right) = (source.join(left), source.join(right));
    let pairs = files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    let calibration = match rig {
        Some(rig) => rig.calibration,
        None => {
            let first = &pairs.first().ok_or_else(|| RecordingError::input(&left, "no images"))?.1;
            Calibration::Rectified(read_rig(&source.join("calib.txt"), cameras, first)?)
        }
    };
    let poses = rows_of::<12>(&source.join("poses.txt"))?;
    let times = rows_of::<1>(&source.join("times.txt"))?;
    let frames = pairs.into_iter().map(|(number, left, right)| {
        let index = number as usize;
        let stamp_ns = match &times {
            Some(times) => {
                (times.get(index).ok_or_else(|| short(source, "times.txt", &left))?[0] * 1e9).round() as u64
            }
            None => files::stamp_ns(number, FRAME_RATE_HZ),
        };
        let row =
            poses.as_ref().map(|poses| poses.get(index).ok_or_else(|| short(source, "poses.txt", &left)));
        let world_from_camera = row.transpose()?.map(pose);
        Ok(PlannedFrame { world_from_camera, ..PlannedFrame::of_images(stamp_ns, left, right) })
    });
    Ok(Plan { calibration, frames: frames.collect::<Result<_, RecordingError>>()? })
}

fn short(source: &Path, file: &str, image: &Path) -> RecordingError {
    RecordingError::input(&source.join(file), format!("it has no line for {}", image.display()))
}

fn read_rig(path: &Path, cameras: [usize; 2], first_image: &Path) -> Result<StereoRig, RecordingError> {
    let numbers = numbers(&files::text(path)?).map_err(|problem| RecordingError::input(path, problem))?;
    let (projections, rest) = numbers.as_chunks::<12>();
    let needed = cameras[1] + 1;
    if !rest.is_empty() || projections.len() < needed {
        let problem = format!("{} numbers, not {needed} projections of 12", numbers.len());
        return Err(RecordingError::input(path, problem));
    }
    let (left, right) = (&projections[cameras[0]], &projections[cameras[1]]);
    let format = files::image_format(first_image)
        .ok_or_else(|| RecordingError::input(first_image, "neither JPEG nor PNG"))?;
    let bytes = std::fs::read(first_image).map_err(RecordingError::io(first_image))?;
    let size = size_px(&EncodedImage { format, bytes });
    let (width_px, height_px) = size.map_err(|error| RecordingError::input(first_image, error))?;
    Ok(StereoRig {
        left: Pinhole { width_px, height_px, fx_px: left[0], fy_px: left[5], cx_px: left[2], cy_px: left[6] },
        baseline_m: left[3] / left[0] - right[3] / right[0],
        right_cx_px: right[2],
    })
}

/// The numbers of a calibration file; labels such as `P0:` are skipped, and numbers printed without a space
/// between them are taken apart after the exponent's digits.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let mut values = Vec::new();
    for word in text.split_whitespace().filter(|word| !word.ends_with(':')) {
        let mut rest = word;
        while !rest.is_empty() {
            let exponent = rest.find(['e', 'E']).map(|at| at + 2 + EXPONENT_DIGITS);
            let end = exponent.filter(|&end| rest.is_char_boundary(end)).unwrap_or(rest.len());
            let (number, after) = rest.split_at(end);
            values.push(number.parse().map_err(|_| format!("{number:?} in {word:?} is no number"))?);
            rest = after;
        }
    }
    Ok(values)
}

/// The lines of `N` numbers of a file; `None` without the file.
fn rows_of<const N: usize>(path: &Path) -> Result<Option<Vec<[f64; N]>>, RecordingError> {
    if !path.exists() {
        return Ok(None);
    }
    let text = files::text(path)?;
    let row = |(index, line): (usize, &str)| {
        let refused = |problem| RecordingError::input(path, format!("line {}: {problem}", index + 1));
        let numbers = numbers(line).map_err(refused)?;
        <[f64; N]>::try_from(numbers.as_slice()).map_err(|_| {
            RecordingError::input(path, format!("line {}: {} numbers, not {N}", index + 1, numbers.len()))
        })
    };
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
        .map(row)
        .collect::<Result<_, _>>()
        .map(Some)
}

/// A 3x4 matrix, row by row; its seven printed digits are made a rotation again.
fn pose(m: &[f64; 12]) -> Pose {
    let rotation =
        Rotation3::from_matrix(&Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]));
    Pose::from_parts(Translation3::new(m[3], m[7], m[11]), UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_glued_together_are_taken_apart() {
        let glued = "P0: 7.070912e+02 1.5e+00-3.798145e+02 0.000000000000e+001.000000000000e+00 12";
        assert_eq!(numbers(glued).unwrap(), [707.0912, 1.5, -379.8145, 0.0, 1.0, 12.0]);
    }

    #[test]
    fn a_word_that_is_no_number_is_named() {
        assert!(numbers("1.0e+00 oops").unwrap_err().contains("oops"));
    }
}
