//! KITTI odometry: `calib.txt` with the projections of the rectified cameras, `poses.txt` with one 3x4
//! `world_from_camera` a line, images named by their index.
//!
//! Also read are the benchmark's own names for its grey cameras: `image_0` and `image_1`, `calib.txt` with `P0:`
//! and `P1:` first, and `times.txt` in seconds.

use std::path::{Path, PathBuf};

use geometry::{Pinhole, Pose, StereoRig};

use super::{Given, Images, Plan, PlannedFrame, files};
use crate::rotation::pose_from_rows;
use crate::{Calibration, RecordingError};

/// Rate of the recording cameras where there is no `times.txt`.
const FRAME_RATE_HZ: f64 = 10.0;
const FOLDERS: [(&str, &str); 2] = [("image_l", "image_r"), ("image_0", "image_1")];
/// Digits of an exponent, after its sign.
const EXPONENT_DIGITS: usize = 2;

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let folders = FOLDERS.into_iter().find(|(left, _)| source.join(left).is_dir());
    let (left, right) =
        folders.ok_or_else(|| RecordingError::input(source, "no image_l or image_0 folder"))?;
    let (left, right) = (source.join(left), source.join(right));
    let pairs = files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    let calibration = match (given.rig, pairs.first()) {
        (Some(rig), _) => rig.calibration,
        (None, Some((_, first, _))) => Calibration::Rectified(read_rig(&source.join("calib.txt"), first)?),
        (None, None) => return Err(RecordingError::input(&left, "no images")),
    };
    let (poses, times) = (Table::<12>::read(source, "poses.txt")?, Table::<1>::read(source, "times.txt")?);
    let frames = pairs.iter().map(|&(number, ..)| {
        let stamp_ns = match (given.frame_rate_hz, &times) {
            (Some(rate_hz), _) => files::stamp_ns(number, rate_hz),
            (None, Some(times)) => times.stamp_ns(number)?,
            (None, None) => files::stamp_ns(number, FRAME_RATE_HZ),
        };
        let world_from_camera = poses.as_ref().map(|poses| poses.pose(number)).transpose()?;
        Ok(PlannedFrame { world_from_camera, ..PlannedFrame::at(stamp_ns) })
    });
    let frames = frames.collect::<Result<_, RecordingError>>()?;
    Ok(Plan { calibration, frames, images: Images::of_pairs(pairs) })
}

fn read_rig(path: &Path, first_image: &Path) -> Result<StereoRig, RecordingError> {
    let numbers = numbers(&files::text(path)?).map_err(|problem| RecordingError::input(path, problem))?;
    let (projections, rest) = numbers.as_chunks::<12>();
    let ([left, right, ..], []) = (projections, rest) else {
        let problem = format!("{} numbers, not 12 for each of two cameras or more", numbers.len());
        return Err(RecordingError::input(path, problem));
    };
    let (width_px, height_px) = files::image_size_px(first_image)?;
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

/// A file with `N` numbers a line, one line for each image.
struct Table<const N: usize> {
    path: PathBuf,
    rows: Vec<[f64; N]>,
}

impl<const N: usize> Table<N> {
    /// `None` without the file.
    fn read(folder: &Path, name: &str) -> Result<Option<Self>, RecordingError> {
        let path = folder.join(name);
        if !path.exists() {
            return Ok(None);
        }
        let mut table = Self { path, rows: Vec::new() };
        for line in files::text(&table.path)?.lines() {
            let index = table.rows.len() as u64;
            let numbers = numbers(line).map_err(|problem| table.refused(index, &problem))?;
            let row = <[f64; N]>::try_from(numbers.as_slice());
            table
                .rows
                .push(row.map_err(|_| table.refused(index, &format!("{} numbers, not {N}", numbers.len())))?);
        }
        Ok(Some(table))
    }

    fn row(&self, image: u64) -> Result<&[f64; N], RecordingError> {
        let row = usize::try_from(image).ok().and_then(|image| self.rows.get(image));
        row.ok_or_else(|| RecordingError::input(&self.path, format!("it has no line for image {image}")))
    }

    fn refused(&self, image: u64, problem: &str) -> RecordingError {
        RecordingError::input(&self.path, format!("line {}: {problem}", image + 1))
    }
}

impl Table<1> {
    fn stamp_ns(&self, image: u64) -> Result<u64, RecordingError> {
        let [seconds] = *self.row(image)?;
        // Written so that a NaN is refused too.
        if !(0.0..1e10).contains(&seconds) {
            return Err(self.refused(image, &format!("{seconds} is no time in seconds")));
        }
        Ok((seconds * 1e9).round() as u64)
    }
}

impl Table<12> {
    /// A 3x4 matrix, row by row.
    fn pose(&self, image: u64) -> Result<Pose, RecordingError> {
        let row = self.row(image)?;
        pose_from_rows(row).ok_or_else(|| self.refused(image, &format!("{row:?} is no rigid motion")))
    }
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
