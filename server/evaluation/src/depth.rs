//! Scores of the depth maps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::DepthMap;
use recording::export::read_pfm;
use serde::Serialize;

use crate::statistics::{MM_PER_M, Statistics};
use crate::truth::Truth;
use crate::{EvaluationError, Notes};

/// Error (m) of a bad pixel, and of a very bad one.
const BAD_M: [f64; 2] = [0.002, 0.005];
/// A fit upside down that is better than this share of the fit as it is gives a warning.
const FLIPPED_SHARE: f64 = 0.5;

/// Scores over all pixels that have a true depth, of all frames with a saved and a true map.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DepthScores {
    /// Mean absolute error where there is an estimate.
    pub depth_mae_mm: Option<f64>,
    /// Share of pixels that have an estimate.
    pub depth_coverage: Option<f64>,
    /// How the errors are distributed.
    pub depth: Option<DepthDetail>,
    /// What was compared.
    pub depth_frames: Option<DepthFrames>,
}

/// How depth errors are distributed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DepthDetail {
    /// Median over the frames of each frame's median error.
    pub median_mm: f64,
    /// Share of estimates off by more than 2 mm.
    pub bad_2mm: f64,
    /// Share of estimates off by more than 5 mm.
    pub bad_5mm: f64,
}

/// Which depth maps were compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DepthFrames {
    /// Maps compared.
    pub scored: usize,
    /// Maps in the folder.
    pub files: usize,
    /// Maps of another size than the truth.
    pub wrong_size: usize,
    /// Number of the first frame in the file names, 0 or 1.
    pub first_number: usize,
}

#[derive(Default)]
struct Sums {
    frames: usize,
    wrong_size: usize,
    true_pixels: usize,
    pixels: usize,
    error_m: f64,
    bad: [usize; 2],
    medians_m: Vec<f64>,
    flipped_means_m: f64,
}

pub(crate) fn score(
    results: &Path,
    truth: &Truth<'_>,
    notes: &mut Notes,
) -> Result<DepthScores, EvaluationError> {
    let files = numbered_maps(&results.join("depth"))?;
    if files.is_empty() {
        notes.missing.push("depth/*.pfm".into());
        return Ok(DepthScores::default());
    }
    let counts_from_one = !files.contains_key(&0) && files.contains_key(&truth.frame_stamps_ns.len());
    let first_number = usize::from(counts_from_one);
    let mut sums = Sums::default();
    for real in truth.depths()? {
        let real = real?;
        let Some(frame) = truth.frame(real.stamp_ns) else { continue };
        // Frames without a file (lost or dropped) are told by `depth_frames`.
        let Some(file) = files.get(&(frame + first_number)) else { continue };
        sums.add(&read_pfm(file)?, &real.depth);
    }
    if sums.frames == 0 {
        notes.missing.push("truth: depth (no frame with both)".into());
    } else if sums.flipped_means_m / (sums.frames as f64) < FLIPPED_SHARE * sums.error_m / sums.pixels as f64
    {
        notes.warnings.push("depth fits better upside down: PFM rows run from bottom to top".into());
    }
    Ok(sums.scores(files.len(), first_number))
}

/// The maps in a folder by the numbers in their names; empty without the folder.
fn numbered_maps(folder: &Path) -> Result<BTreeMap<usize, PathBuf>, EvaluationError> {
    let mut maps = BTreeMap::new();
    if !folder.is_dir() {
        return Ok(maps);
    }
    for entry in std::fs::read_dir(folder).map_err(EvaluationError::io(folder))? {
        let path = entry.map_err(EvaluationError::io(folder))?.path();
        let number = path.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
        if let Some(number) = number.filter(|_| path.extension().is_some_and(|extension| extension == "pfm"))
        {
            maps.insert(number, path);
        }
    }
    Ok(maps)
}

impl Sums {
    fn add(&mut self, estimate: &DepthMap, truth: &DepthMap) {
        let true_pixels = truth.pixels().iter().filter(|&&depth_m| is_depth(depth_m)).count();
        if true_pixels == 0 {
            return;
        }
        if estimate.size() != truth.size() {
            self.wrong_size += 1;
            return;
        }
        let errors_m = errors_m(estimate.pixels().iter().zip(truth.pixels()));
        let flipped_rows = (0..truth.height()).flat_map(|y| estimate.row(truth.height() - 1 - y));
        let flipped_m = errors_m_mean(&self::errors_m(flipped_rows.zip(truth.pixels())));
        self.frames += 1;
        self.true_pixels += true_pixels;
        self.pixels += errors_m.len();
        self.error_m += errors_m.iter().sum::<f64>();
        self.flipped_means_m += flipped_m;
        for (bad, limit_m) in self.bad.iter_mut().zip(BAD_M) {
            *bad += errors_m.iter().filter(|&&error_m| error_m > limit_m).count();
        }
        self.medians_m.extend(Statistics::of(errors_m).map(|errors| errors.median));
    }

    fn scores(self, files: usize, first_number: usize) -> DepthScores {
        let frames = DepthFrames { scored: self.frames, files, wrong_size: self.wrong_size, first_number };
        let pixels = self.pixels as f64;
        let detail = Statistics::of(self.medians_m).map(|medians_m| DepthDetail {
            median_mm: medians_m.median * MM_PER_M,
            bad_2mm: self.bad[0] as f64 / pixels,
            bad_5mm: self.bad[1] as f64 / pixels,
        });
        DepthScores {
            depth_mae_mm: (self.pixels > 0).then(|| self.error_m / pixels * MM_PER_M),
            depth_coverage: (self.true_pixels > 0).then(|| pixels / self.true_pixels as f64),
            depth: detail,
            depth_frames: Some(frames),
        }
    }
}

fn is_depth(depth_m: f32) -> bool {
    depth_m.is_finite() && depth_m > 0.0
}

/// Absolute differences where both are depths.
fn errors_m<'a>(pairs: impl Iterator<Item = (&'a f32, &'a f32)>) -> Vec<f64> {
    pairs
        .filter(|&(&estimate, &truth)| is_depth(estimate) && is_depth(truth))
        .map(|(&estimate, &truth)| (f64::from(estimate) - f64::from(truth)).abs())
        .collect()
}

fn errors_m_mean(errors_m: &[f64]) -> f64 {
    if errors_m.is_empty() { 0.0 } else { errors_m.iter().sum::<f64>() / errors_m.len() as f64 }
}
