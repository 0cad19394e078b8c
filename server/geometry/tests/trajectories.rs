//! Trajectory metrics against the scoring script's figures, and alignment by its properties.

use geometry::trajectory::{Scale, ate, path_length_m, rpe, umeyama};
use geometry::{Pose, se3};
use nalgebra::{Point3, Vector3, Vector6};
use proptest::prelude::*;

fn pose(turn: [f64; 3], place_m: [f64; 3]) -> Pose {
    Pose::new(Vector3::from(place_m), Vector3::from(turn))
}

/// Twenty poses of a smooth path, and the same with about a millimetre of noise in another world.
fn truth_and_estimate() -> (Vec<Pose>, Vec<Pose>) {
    let world = pose([0.1, 0.2, -0.1], [0.02, 0.01, -0.03]);
    let (truths, estimates) = (0..20)
        .map(|i| {
            let i = f64::from(i);
            let truth =
                pose([0.1 + 0.01 * i, 0.02 * i, -0.03], [0.01 * i, 0.02 * (0.3 * i).sin(), 0.05 + 0.003 * i]);
            let noise = pose(
                [0.001 * i.cos() + 1e-9, 0.002 * (2.0 * i).sin(), 0.0005],
                [0.001 * (5.0 * i).sin(), 0.0007 * (3.0 * i).cos(), 0.0004 * (7.0 * i).sin()],
            );
            (truth, world * truth * noise)
        })
        .unzip();
    (truths, estimates)
}

fn assert_near(name: &str, ours: f64, reference: f64) {
    assert!((ours - reference).abs() < 1e-10, "{name}: {ours} against {reference}");
}

#[test]
fn absolute_errors_are_those_of_the_scoring_script() {
    let (truths, estimates) = truth_and_estimate();
    let error = ate(&estimates, &truths).expect("twenty poses");
    assert_near("rmse", error.rmse_m, 0.0008771712264353548);
    assert_near("max", error.max_m, 0.0011742601589941023);
    assert_near("unaligned", error.unaligned_rmse_m, 0.06304079497153392);
    assert_near("scale", error.scale, 0.9983151541287556);
    assert_near("path", path_length_m(&truths), 0.2125123623196251);
}

#[test]
fn relative_errors_are_those_of_the_scoring_script_and_skip_lost_frames() {
    let (truths, estimates) = truth_and_estimate();
    let mut estimates: Vec<_> = estimates.into_iter().map(Some).collect();
    estimates[8] = None;
    let truths: Vec<_> = truths.into_iter().map(Some).collect();
    let error = rpe(&estimates, &truths).expect("neighbouring frames");
    assert_eq!(error.pairs, 17);
    assert_near("translation", error.translation_rmse_m, 0.001275934550882131);
    assert_near("rotation", error.rotation_rmse_rad.to_degrees(), 0.14524528133662565);
}

#[test]
fn too_few_poses_have_no_error() {
    let (truths, estimates) = truth_and_estimate();
    assert_eq!(ate(&estimates[..2], &truths[..2]), None);
    assert_eq!(rpe(&[Some(estimates[0]), None], &[Some(truths[0]), Some(truths[1])]), None);
}

#[test]
fn a_mirrored_set_is_not_aligned_by_a_mirror() {
    let points: Vec<_> =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]].map(Point3::from).to_vec();
    let mirrored: Vec<_> = points.iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
    let best = umeyama(&points, &mirrored, Scale::One).expect("four points");
    assert!((best.rotation.matrix().determinant() - 1.0).abs() < 1e-12);
}

proptest! {
    #[test]
    fn umeyama_finds_the_similarity_that_was_applied(
        tangent in prop::array::uniform6(-1.5..1.5f64),
        scale in 0.2..5.0f64,
        points in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 6..40),
    ) {
        let motion = se3::exp(&Vector6::from(tangent));
        let source: Vec<_> = points.into_iter().map(Point3::from).collect();
        let target: Vec<_> = source.iter().map(|point| motion * (point * scale)).collect();
        let found = umeyama(&source, &target, Scale::Free).expect("points");
        prop_assert!((found.scale - scale).abs() < 1e-9);
        for (source, target) in source.iter().zip(&target) {
            prop_assert!((found.transform(source) - target).norm() < 1e-9);
        }
    }
}
