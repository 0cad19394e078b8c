//! Absolute and relative trajectory error (Sturm et al. 2012).

use nalgebra::Point3;

use super::{Scale, umeyama};
use crate::Pose;

/// Fewest poses that an alignment is taken from.
const ALIGNED_POSES_MIN: usize = 3;

/// How far the positions are off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsoluteError {
    /// Root mean square after the best rigid alignment.
    pub rmse_m: f64,
    /// Largest after the best rigid alignment.
    pub max_m: f64,
    /// Root mean square with both worlds taken as equal.
    pub unaligned_rmse_m: f64,
    /// The scale that a similarity alignment would choose.
    pub scale: f64,
}

/// How far the motions between neighbouring frames are off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeError {
    /// Root mean square of the translations.
    pub translation_rmse_m: f64,
    /// Root mean square of the rotation angles.
    pub rotation_rmse_rad: f64,
    /// Pairs of neighbouring frames with all four poses.
    pub pairs: usize,
}

/// Absolute trajectory error of estimates against the truth at the same times.
///
/// `None` for fewer than three poses, or lists of different length.
pub fn ate(estimates: &[Pose], truths: &[Pose]) -> Option<AbsoluteError> {
    if estimates.len() != truths.len() || estimates.len() < ALIGNED_POSES_MIN {
        return None;
    }
    let (estimates, truths) = (positions(estimates), positions(truths));
    let rigid = umeyama(&estimates, &truths, Scale::One)?;
    let aligned: Vec<_> = estimates.iter().map(|position| rigid.transform(position)).collect();
    Some(AbsoluteError {
        rmse_m: rmse(distances(&aligned, &truths)),
        max_m: distances(&aligned, &truths).fold(0.0, f64::max),
        unaligned_rmse_m: rmse(distances(&estimates, &truths)),
        scale: umeyama(&estimates, &truths, Scale::Free)?.scale,
    })
}

/// Relative pose error over neighbouring frames; both slices hold one entry per frame.
///
/// `None` where no two neighbouring frames have all their poses.
pub fn rpe(estimates: &[Option<Pose>], truths: &[Option<Pose>]) -> Option<RelativeError> {
    let motions = estimates.windows(2).zip(truths.windows(2)).filter_map(|(estimate, truth)| {
        Some(pose_error(&(estimate[0]?, estimate[1]?), &(truth[0]?, truth[1]?)))
    });
    let (translations_m, angles_rad): (Vec<_>, Vec<_>) = motions.unzip();
    (!translations_m.is_empty()).then(|| RelativeError {
        translation_rmse_m: rmse(translations_m.iter().copied()),
        rotation_rmse_rad: rmse(angles_rad.iter().copied()),
        pairs: translations_m.len(),
    })
}

/// Translation (m) and angle (rad) by which an estimated motion from one pose to another misses the true one.
pub fn pose_error(estimate: &(Pose, Pose), truth: &(Pose, Pose)) -> (f64, f64) {
    let miss = truth.0.inv_mul(&truth.1).inv_mul(&estimate.0.inv_mul(&estimate.1));
    (miss.translation.vector.norm(), miss.rotation.angle())
}

/// Length of the path through the poses' positions, in metres.
pub fn path_length_m(poses: &[Pose]) -> f64 {
    poses.windows(2).map(|pair| (pair[1].translation.vector - pair[0].translation.vector).norm()).sum()
}

fn positions(poses: &[Pose]) -> Vec<Point3<f64>> {
    poses.iter().map(|pose| pose.translation.vector.into()).collect()
}

fn distances<'a>(a: &'a [Point3<f64>], b: &'a [Point3<f64>]) -> impl ExactSizeIterator<Item = f64> {
    a.iter().zip(b).map(|(a, b)| (a - b).norm())
}

fn rmse(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}
