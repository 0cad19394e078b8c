//! The model's depth against depth that somebody else measured, outside instruments.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

use geometry::{DepthMap, Mask};
use recording::export::read_pfm;
use recording::{Calibration, RecordingReader};

use crate::error::AccuracyError;

const MM_PER_M: f64 = 1e3;

/// Root of the mean square difference over all pixels of the frames that have both depths; `None` without any.
pub fn rmse_mm(
    maps: &Path,
    recording: &RecordingReader,
    frames: &RangeInclusive<u64>,
) -> Result<Option<f64>, AccuracyError> {
    let masks = masks(recording, frames)?;
    let mut squares = (0.0, 0u64);
    for truth in recording.depths()? {
        let truth = truth?;
        let Some((number, mask)) = masks.get(&truth.stamp_ns) else { continue };
        let file = maps.join(format!("{number:06}.pfm"));
        if file.is_file() {
            add_squares_mm(&mut squares, &read_pfm(&file)?, &truth.depth, mask.as_ref());
        }
    }
    Ok((squares.1 > 0).then(|| (squares.0 / squares.1 as f64).sqrt()))
}

/// Number and mask of the frames asked for, by their stamps.
fn masks(
    recording: &RecordingReader,
    frames: &RangeInclusive<u64>,
) -> Result<BTreeMap<u64, (u64, Option<Mask>)>, AccuracyError> {
    let calibration: Calibration = recording.calibration()?;
    let mut masks = BTreeMap::new();
    for (number, pair) in (0..).zip(recording.stereo()?) {
        let pair = pair?;
        if frames.contains(&number) {
            let decode = |mask| recording::decode_gray(mask, calibration.image_size_px());
            masks.insert(pair.stamp_ns, (number, pair.mask.as_ref().map(decode).transpose()?));
        }
    }
    Ok(masks)
}

fn add_squares_mm((sum, count): &mut (f64, u64), found: &DepthMap, truth: &DepthMap, mask: Option<&Mask>) {
    if found.size() != truth.size() {
        return;
    }
    let is_depth = |depth_m: f32| depth_m.is_finite() && depth_m > 0.0;
    for (pixel, (&found, &truth)) in found.pixels().iter().zip(truth.pixels()).enumerate() {
        let covered = mask.is_some_and(|mask| mask.pixels()[pixel] != 0);
        if !covered && is_depth(found) && is_depth(truth) {
            *sum += (f64::from(found - truth) * MM_PER_M).powi(2);
            *count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_and_unknown_pixels_do_not_count() {
        let found = DepthMap::from_vec(2, 2, vec![0.050, 0.052, 0.0, 0.9]).expect("four pixels");
        let truth = DepthMap::from_vec(2, 2, vec![0.050, 0.050, 0.050, 0.050]).expect("four pixels");
        let mask = Mask::from_vec(2, 2, vec![0, 0, 0, 255]).expect("four pixels");
        let mut squares = (0.0, 0);
        add_squares_mm(&mut squares, &found, &truth, Some(&mask));
        assert_eq!(squares.1, 2);
        assert!((squares.0 - 4.0).abs() < 1e-4, "{}", squares.0);
    }
}
