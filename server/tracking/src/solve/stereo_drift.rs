//! How far the rig's disparity has drifted from its calibration.
//!
//! The two optical paths of an endoscope bend against each other by force and heat: in Hamlyn set 6 the rows of the two
//! images move by 2 px within seconds, and disparities with them. With the map at a known scale, the left image alone
//! fixes the pose, since a step along the axis changes what is seen at the border far more than it changes a disparity; what
//! all disparities then have too much is drift.

use geometry::{Pose, StereoRig};

use super::reprojection::PointObservation;

/// Fewer stereo observations say nothing about the rig.
const OBSERVATIONS_MIN: usize = 40;

/// Median excess of the observed disparities over those that the pose predicts, px; `None` from too few observations.
pub fn disparity_excess_px<'a>(
    rig: &StereoRig,
    camera_from_world: &Pose,
    inliers: impl IntoIterator<Item = &'a PointObservation>,
) -> Option<f64> {
    let excess = |point: &PointObservation| {
        point.observation.right_x_px?;
        let residual = point.observation.residual(rig, &(camera_from_world * point.point_in_world))?;
        Some(residual.x - residual.z)
    };
    let mut excesses: Vec<f64> = inliers.into_iter().filter_map(excess).collect();
    if excesses.len() < OBSERVATIONS_MIN {
        return None;
    }
    let middle = excesses.len() / 2;
    Some(*excesses.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Share of an excess that is taken as drift after `elapsed_s`: drift is slow, so what comes and goes quickly is not it.
pub fn gain(elapsed_s: f64, time_constant_s: f64) -> f64 {
    1.0 - (-elapsed_s / time_constant_s).exp()
}

/// What of a measured drift is taken off the disparities: nothing up to `least_px`, which a pose that is a little off explains as well,
/// all of it from twice that on, and in between a part, so that it does not jump.
pub fn believed_drift_px(measured_px: f64, least_px: f64) -> f64 {
    let beyond_px = (measured_px.abs() - least_px).max(0.0);
    (2.0 * beyond_px).min(measured_px.abs()).copysign(measured_px)
}

#[cfg(test)]
mod tests {
    use geometry::Pinhole;
    use nalgebra::{Point2, Point3};

    use super::*;
    use crate::solve::reprojection::{Observation, project};

    const RIG: StereoRig = StereoRig {
        left: Pinhole {
            width_px: 640,
            height_px: 480,
            fx_px: 500.0,
            fy_px: 500.0,
            cx_px: 320.0,
            cy_px: 240.0,
        },
        baseline_m: 0.005,
        right_cx_px: 320.0,
    };

    fn seen(index: usize, excess_px: f64) -> PointObservation {
        let point_in_world = Point3::new(index as f64 * 1e-4 - 5e-3, 0.0, 0.06);
        let predicted = project(&RIG, &point_in_world);
        let observation = Observation {
            pixel: Point2::new(predicted.x, predicted.y),
            right_x_px: Some(predicted.z - excess_px),
            sigma_px: 1.0,
        };
        PointObservation { point_in_world, observation, trust: 1.0 }
    }

    #[test]
    fn the_excess_is_that_of_most_observations() {
        let points: Vec<_> = (0..100).map(|index| seen(index, if index < 30 { 7.0 } else { 0.4 })).collect();
        let excess = disparity_excess_px(&RIG, &Pose::identity(), &points).unwrap();
        assert!((excess - 0.4).abs() < 1e-9, "{excess}");
    }

    #[test]
    fn a_few_observations_say_nothing() {
        let points: Vec<_> = (0..OBSERVATIONS_MIN - 1).map(|index| seen(index, 1.0)).collect();
        assert_eq!(disparity_excess_px(&RIG, &Pose::identity(), &points), None);
    }

    #[test]
    fn a_small_drift_is_not_believed_and_a_large_one_in_full() {
        assert_eq!(believed_drift_px(0.15, 0.2).abs(), 0.0);
        assert_eq!(believed_drift_px(-0.8, 0.2), -0.8);
        assert!((believed_drift_px(-0.3, 0.2) + 0.2).abs() < 1e-12);
        assert_eq!(believed_drift_px(0.3, 0.0), 0.3);
    }

    #[test]
    fn drift_takes_its_time() {
        assert!(gain(1.0 / 30.0, 1.0) < 0.04);
        assert!(gain(5.0, 1.0) > 0.99);
    }
}
