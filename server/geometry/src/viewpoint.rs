//! Cameras placed to look at something: at a point, or so that a whole model is seen.

use nalgebra::{Matrix3, Point3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::{Pinhole, Pose};

/// Half the opening angle of an overview, as a tangent.
pub const OVERVIEW_HALF_OPENING_TANGENT: f64 = 0.45;
/// Furthest that a coordinate in a text may be from the origin, metres.
const COORDINATE_MAX_M: f64 = 1e3;
/// Furthest that the length of a quaternion in a text may be from 1.
const UNIT_TOLERANCE: f64 = 1e-3;
/// Points that an overview is made from, at most: an even sample of a large model has the same bounds.
const SAMPLES: usize = 4000;

impl Pinhole {
    /// A camera with square pixels, centred, whose shorter side opens by twice the angle of this tangent.
    pub fn of_opening((width_px, height_px): (u32, u32), half_opening_tangent: f64) -> Self {
        let focal_px = f64::from(width_px.min(height_px)) / 2.0 / half_opening_tangent;
        Self {
            width_px,
            height_px,
            fx_px: focal_px,
            fy_px: focal_px,
            cx_px: (f64::from(width_px) - 1.0) / 2.0,
            cy_px: (f64::from(height_px) - 1.0) / 2.0,
        }
    }

    /// The same camera with an image of another size, in which all of this one's image lies, in the middle.
    pub fn shown_in(&self, (width_px, height_px): (u32, u32)) -> Self {
        let (width, height) = (f64::from(width_px), f64::from(height_px));
        let (own_width, own_height) = (f64::from(self.width_px), f64::from(self.height_px));
        let scale = (width / own_width).min(height / own_height);
        let place = |center_px: f64, own: f64, side: f64| {
            (center_px + 0.5) * scale - 0.5 + (side - own * scale) / 2.0
        };
        Self {
            width_px,
            height_px,
            fx_px: self.fx_px * scale,
            fy_px: self.fy_px * scale,
            cx_px: place(self.cx_px, own_width, width),
            cy_px: place(self.cy_px, own_height, height),
        }
    }
}

/// `world_from_camera` of a camera at `eye` that looks at `target`, with world y downwards in its image; `None` where
/// the two are one point or not finite.
pub fn looking_at(eye: &Point3<f64>, target: &Point3<f64>) -> Option<Pose> {
    let forward = (target - eye).try_normalize(1e-9)?;
    let finite = eye.iter().chain(forward.iter()).all(|value| value.is_finite());
    finite.then(|| looking_along(forward, *eye))
}

/// A point written `x,y,z`, metres.
///
/// # Errors
/// A sentence that says what is wrong with the text.
pub fn point_from_text(text: &str) -> Result<Point3<f64>, String> {
    Ok(numbers::<3>(text)?.into())
}

/// A pose written `tx,ty,tz,qx,qy,qz,qw`, metres and a unit quaternion.
///
/// # Errors
/// A sentence that says what is wrong with the text.
pub fn pose_from_text(text: &str) -> Result<Pose, String> {
    let [tx, ty, tz, qx, qy, qz, qw] = numbers::<7>(text)?;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    if (quaternion.norm() - 1.0).abs() > UNIT_TOLERANCE {
        return Err(format!("the quaternion in {text:?} has length {}, not 1", quaternion.norm()));
    }
    Ok(Pose::from_parts(Vector3::new(tx, ty, tz).into(), UnitQuaternion::from_quaternion(quaternion)))
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let values = values.map_err(|error| format!("{text:?}: {error}"))?;
    if let Some(value) = values.iter().find(|value| value.is_nan() || value.abs() > COORDINATE_MAX_M) {
        return Err(format!("{value} in {text:?} is not between -{COORDINATE_MAX_M} and {COORDINATE_MAX_M}"));
    }
    values.try_into().map_err(|_| format!("{text:?} does not hold {N} numbers with commas between them"))
}

/// The sphere that most of a model lies in, and the side from which it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its centre, metres in the world.
    pub center_in_world: Point3<f64>,
    /// Its radius.
    pub radius_m: f64,
    /// The direction that the surface faces on the whole, unit length.
    pub facing: Vector3<f64>,
}

impl Bounds {
    /// Of points and their outward normals; a small sphere at the origin where there are none.
    pub fn of<'a>(surfels: impl ExactSizeIterator<Item = (&'a [f32; 3], &'a [f32; 3])>) -> Self {
        let step = surfels.len().div_ceil(SAMPLES).max(1);
        let (points, normals): (Vec<Point3<f64>>, Vec<Vector3<f64>>) = surfels
            .step_by(step)
            .map(|(position, normal)| {
                (Point3::from(position.map(f64::from)), Vector3::from(normal.map(f64::from)))
            })
            .unzip();
        let center_in_world = middle(&points);
        Self {
            center_in_world,
            radius_m: spread(&points, &center_in_world).max(1e-4),
            facing: normals.iter().sum::<Vector3<f64>>().try_normalize(1e-9).unwrap_or_else(|| -Vector3::z()),
        }
    }

    /// A camera that sees the sphere from the side that the surface faces.
    pub fn overview(&self, size_px: (u32, u32)) -> (Pinhole, Pose) {
        let eye = self.center_in_world + self.facing * (self.radius_m / OVERVIEW_HALF_OPENING_TANGENT * 1.1);
        (Pinhole::of_opening(size_px, OVERVIEW_HALF_OPENING_TANGENT), looking_along(-self.facing, eye))
    }
}

/// `world_from_camera` of a camera at `eye` that looks along `forward` with world y downwards.
fn looking_along(forward: Vector3<f64>, eye: Point3<f64>) -> Pose {
    let down = if forward.cross(&Vector3::y()).norm() > 1e-3 { Vector3::y() } else { Vector3::z() };
    let right = down.cross(&forward).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
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
    fn every_point_of_a_patch_lies_in_the_overview() {
        let points: Vec<[f32; 3]> =
            (0..400).map(|i| [(i % 20) as f32 * 2e-3, (i / 20) as f32 * 1e-3, 0.05]).collect();
        let normal = [0.2873, 0.0, -0.9578];
        let (pinhole, world_from_camera) =
            Bounds::of(points.iter().map(|point| (point, &normal))).overview((320, 240));
        for point in &points {
            let in_camera = world_from_camera.inverse() * Point3::from(point.map(f64::from));
            let pixel = pinhole.project(&in_camera);
            assert!(
                in_camera.z > 0.0 && (0.0..320.0).contains(&pixel.x) && (0.0..240.0).contains(&pixel.y),
                "{pixel}"
            );
        }
    }

    #[test]
    fn an_empty_model_has_a_view_too() {
        let (_, pose) = Bounds::of(std::iter::empty()).overview((320, 240));
        assert!(pose.translation.vector.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn what_is_looked_at_is_in_the_middle_and_world_y_points_down() {
        let (eye, target) = (Point3::new(0.1, -0.2, -0.3), Point3::new(0.0, 0.05, 0.1));
        let world_from_camera = looking_at(&eye, &target).unwrap();
        let pinhole = Pinhole::of_opening((640, 480), 0.4);
        let seen = |point: Point3<f64>| pinhole.project(&(world_from_camera.inverse() * point));
        assert!((seen(target).coords - nalgebra::Vector2::new(319.5, 239.5)).norm() < 1e-9);
        assert!(seen(target + Vector3::y() * 1e-3).y > 239.6);
    }

    #[test]
    fn nothing_looks_at_where_it_is_or_at_what_is_no_point() {
        let eye = Point3::new(0.1, 0.0, 0.0);
        assert_eq!(looking_at(&eye, &eye), None);
        assert_eq!(looking_at(&eye, &Point3::new(f64::NAN, 0.0, 0.0)), None);
        assert_eq!(looking_at(&Point3::new(f64::INFINITY, 0.0, 0.0), &eye), None);
    }

    #[test]
    fn points_and_poses_are_read_from_text_and_bad_ones_refused() {
        assert_eq!(point_from_text("1, -2.5,3e-2").unwrap(), Point3::new(1.0, -2.5, 0.03));
        assert_eq!(pose_from_text("0,0,0.1,0,0,0,1").unwrap(), Pose::translation(0.0, 0.0, 0.1));
        for text in ["", "1,2", "1,2,3,4", "1,2,NaN", "1,2,inf", "1,2,1e9", "1;2;3"] {
            assert!(point_from_text(text).is_err(), "{text}");
        }
        assert!(pose_from_text("0,0,0,0,0,0,0").is_err());
    }

    #[test]
    fn a_camera_shown_in_a_wider_picture_keeps_its_image_whole_and_in_the_middle() {
        let camera =
            Pinhole { width_px: 640, height_px: 480, fx_px: 500.0, fy_px: 510.0, cx_px: 300.0, cy_px: 250.0 };
        let shown = camera.shown_in((640, 240));
        let ray = Point3::new(0.1, -0.2, 1.0);
        let (own, there) = (camera.project(&ray), shown.project(&ray));
        assert!(((own.x + 0.5) / 2.0 + 160.0 - 0.5 - there.x).abs() < 1e-9, "{there}");
        assert!(((own.y + 0.5) / 2.0 - 0.5 - there.y).abs() < 1e-9, "{there}");
    }
}
