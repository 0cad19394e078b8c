//! A view that shows the whole model, for pictures in reports.

use geometry::{Pinhole, Pose};
use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};

/// Half the opening angle of the picture, as a tangent.
const HALF_WIDTH_TANGENT: f64 = 0.45;

/// A camera that sees the bounding sphere of `points_in_world` from the side they face.
///
/// `normals` are the points' outward normals; world y is down in the picture, as in the first camera.
pub fn overview(
    points_in_world: &[Point3<f64>],
    normals: &[Vector3<f64>],
    width_px: u32,
    height_px: u32,
) -> (Pinhole, Pose) {
    let centre = middle(points_in_world);
    let radius_m = spread(points_in_world, &centre).max(1e-4);
    let facing = normals.iter().sum::<Vector3<f64>>().try_normalize(1e-9).unwrap_or_else(|| -Vector3::z());
    let shorter_px = f64::from(width_px.min(height_px));
    let focal_px = shorter_px / 2.0 / HALF_WIDTH_TANGENT;
    let pinhole = Pinhole {
        width_px,
        height_px,
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: f64::from(width_px - 1) / 2.0,
        cy_px: f64::from(height_px - 1) / 2.0,
    };
    let eye = centre + facing * (radius_m / HALF_WIDTH_TANGENT * 1.1);
    (pinhole, looking_along(-facing, eye))
}

/// `world_from_camera` of a camera at `eye` that looks along `forward` with world y downwards.
fn looking_along(forward: Vector3<f64>, eye: Point3<f64>) -> Pose {
    let down = if forward.cross(&Vector3::y()).norm() > 1e-3 { Vector3::y() } else { Vector3::z() };
    let right = down.cross(&forward).normalize();
    let axes = nalgebra::Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Pose::from_parts(eye.coords.into(), rotation)
}

/// The middle of each axis' 2nd to 98th percentile: a few stray points do not shrink the picture.
fn middle(points: &[Point3<f64>]) -> Point3<f64> {
    let along = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((values.len() as f64 * share) as usize).copied().unwrap_or(0.0);
        (at(0.02) + at(0.98)) / 2.0
    };
    Point3::new(along(0), along(1), along(2))
}

fn spread(points: &[Point3<f64>], centre: &Point3<f64>) -> f64 {
    let mut distances: Vec<f64> = points.iter().map(|p| (p - centre).norm()).collect();
    distances.sort_by(f64::total_cmp);
    distances.get((distances.len() as f64 * 0.98) as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_a_patch_lies_in_the_picture() {
        let points: Vec<_> =
            (0..400).map(|i| Point3::new(f64::from(i % 20) * 2e-3, f64::from(i / 20) * 1e-3, 0.05)).collect();
        let normals = vec![Vector3::new(0.3, 0.0, -1.0).normalize(); points.len()];
        let (pinhole, world_from_camera) = overview(&points, &normals, 320, 240);
        for point in &points {
            let in_camera = world_from_camera.inverse() * point;
            let pixel = pinhole.project(&in_camera);
            assert!(
                in_camera.z > 0.0 && (0.0..320.0).contains(&pixel.x) && (0.0..240.0).contains(&pixel.y),
                "{pixel}"
            );
        }
    }

    #[test]
    fn an_empty_model_has_a_view_too() {
        let (_, pose) = overview(&[], &[], 320, 240);
        assert!(pose.translation.vector.iter().all(|v| v.is_finite()));
    }
}
