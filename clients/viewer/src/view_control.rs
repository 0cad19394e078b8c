//! Where the viewer looks from: an orbit that people steer, or the scope's own view.

use geometry::viewpoint::Bounds;
use geometry::{Pinhole, Pose};
use nalgebra::{Point3, UnitQuaternion, Vector3};

/// Tangent of half the angle by which the shorter side of an orbit's picture opens.
const HALF_OPENING_TANGENT: f64 = geometry::viewpoint::OVERVIEW_HALF_OPENING_TANGENT;
/// By a drag over the height of the window.
const TURN_RAD: f64 = 3.0;
/// Of the distance, by one step of a wheel.
const ZOOM_STEP: f64 = 0.9;
/// Distances to what is looked at.
const DISTANCES_M: std::ops::RangeInclusive<f64> = 1e-3..=10.0;
/// By how much the model sticks out of what was fitted before it is fitted again.
const OUTGROWN: f64 = 1.1;

/// A camera that looks at something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The camera.
    pub pinhole: Pinhole,
    /// Maps camera points to world points.
    pub world_from_camera: Pose,
    /// Distance of what it looks at.
    pub convergence_m: f64,
}

/// The view's state.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewControl {
    target_in_world: Point3<f64>,
    rotation: UnitQuaternion<f64>,
    distance_m: f64,
    half_opening_tangent: f64,
    following: bool,
    /// Somebody has moved the view, so it does not move by itself any more.
    is_held: bool,
    fitted: Option<Bounds>,
}

impl ViewControl {
    /// Fits the model once there is one, or looks through the scope.
    pub fn new(following: bool) -> Self {
        Self {
            target_in_world: Point3::origin(),
            rotation: UnitQuaternion::identity(),
            distance_m: 0.2,
            half_opening_tangent: HALF_OPENING_TANGENT,
            following,
            is_held: false,
            fitted: None,
        }
    }

    /// Stands still at a pose; the shorter side opens by twice the angle of the tangent.
    pub fn at(world_from_camera: &Pose, half_opening_tangent: f64) -> Self {
        let mut view = Self::new(false);
        view.is_held = true;
        view.rotation = world_from_camera.rotation;
        view.half_opening_tangent = half_opening_tangent;
        view.target_in_world = world_from_camera * Point3::new(0.0, 0.0, view.distance_m);
        view
    }

    /// The model is here now: fitted while nobody holds the view and it has outgrown what was fitted. What was fixed at
    /// a pose turns about the model from now on.
    pub fn model_is_at(&mut self, bounds: &Bounds) {
        let outgrown = self.fitted.is_none_or(|fitted| {
            let offset_m = (bounds.center_in_world - fitted.center_in_world).norm();
            offset_m + bounds.radius_m > OUTGROWN * fitted.radius_m
        });
        if !self.is_held && outgrown {
            self.fit(bounds);
        } else if self.fitted.is_none() {
            self.fitted = Some(*bounds);
            self.look_as_far_as(bounds);
        }
    }

    /// Shows the whole model from the side that it faces.
    pub fn reset(&mut self) {
        self.is_held = false;
        self.following = false;
        self.half_opening_tangent = HALF_OPENING_TANGENT;
        if let Some(bounds) = self.fitted {
            self.fit(&bounds);
        }
    }

    fn fit(&mut self, bounds: &Bounds) {
        let (_, world_from_camera) = bounds.overview((1, 1));
        self.fitted = Some(*bounds);
        self.rotation = world_from_camera.rotation;
        self.target_in_world = bounds.center_in_world;
        self.distance_m =
            (Point3::from(world_from_camera.translation.vector) - bounds.center_in_world).norm();
    }

    /// Moves the point that is turned about along the line of sight, to where the model is.
    fn look_as_far_as(&mut self, bounds: &Bounds) {
        let (eye, forward) = (self.eye(), self.rotation * Vector3::z());
        let along_m = (bounds.center_in_world - eye).dot(&forward);
        self.distance_m = along_m.clamp(*DISTANCES_M.start(), *DISTANCES_M.end());
        self.target_in_world = eye + forward * self.distance_m;
    }

    fn eye(&self) -> Point3<f64> {
        self.target_in_world - self.rotation * Vector3::z() * self.distance_m
    }

    /// Whether it looks through the scope.
    pub fn is_following(&self) -> bool {
        self.following
    }

    /// Looks through the scope, or not any more.
    pub fn toggle_follow(&mut self) {
        self.following = !self.following;
    }

    /// Turns about the target, by a drag in shares of the window's height.
    pub fn turn(&mut self, right: f64, down: f64) {
        self.take_hold();
        let about_world_y = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), right * TURN_RAD);
        let about_own_x = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -down * TURN_RAD);
        self.rotation = about_world_y * self.rotation * about_own_x;
    }

    /// Moves sideways, by a drag in shares of the window's height.
    pub fn pan(&mut self, right: f64, down: f64) {
        self.take_hold();
        let height_m = 2.0 * self.half_opening_tangent * self.distance_m;
        self.target_in_world -= self.rotation * Vector3::new(right, down, 0.0) * height_m;
    }

    /// Comes nearer, by steps of a wheel.
    pub fn zoom(&mut self, steps: f64) {
        self.take_hold();
        let distance_m = self.distance_m * ZOOM_STEP.powf(steps);
        self.distance_m = distance_m.clamp(*DISTANCES_M.start(), *DISTANCES_M.end());
    }

    fn take_hold(&mut self) {
        self.is_held = true;
        self.following = false;
    }

    /// The camera for a picture of this size; `scope` is the scope's camera and where it is.
    pub fn camera(&self, size_px: (u32, u32), scope: Option<&(Pinhole, Pose)>) -> Camera {
        match scope.filter(|_| self.following) {
            Some((pinhole, world_from_camera)) => Camera {
                pinhole: pinhole.shown_in(size_px),
                world_from_camera: *world_from_camera,
                convergence_m: self.depth_from(world_from_camera),
            },
            None => Camera {
                pinhole: Pinhole::of_opening(size_px, self.half_opening_tangent),
                world_from_camera: Pose::from_parts(self.eye().coords.into(), self.rotation),
                convergence_m: self.distance_m,
            },
        }
    }

    /// Depth of the middle of the model.
    fn depth_from(&self, world_from_camera: &Pose) -> f64 {
        let depth_m = self.fitted.map(|bounds| (world_from_camera.inverse() * bounds.center_in_world).z);
        depth_m.filter(|depth_m| DISTANCES_M.contains(depth_m)).unwrap_or(self.distance_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: Bounds = Bounds {
        center_in_world: Point3::new(0.01, 0.02, 0.1),
        radius_m: 0.03,
        facing: Vector3::new(0.0, 0.0, -1.0),
    };

    fn place_of(view: &ViewControl, point: &Point3<f64>) -> Point3<f64> {
        view.camera((640, 480), None).world_from_camera.inverse() * point
    }

    #[test]
    fn the_model_is_fitted_as_the_servers_overview_shows_it() {
        let mut view = ViewControl::new(false);
        view.model_is_at(&MODEL);
        let (pinhole, world_from_camera) = MODEL.overview((640, 480));
        let camera = view.camera((640, 480), None);
        assert_eq!(camera.pinhole, pinhole);
        assert!(
            (camera.world_from_camera.to_homogeneous() - world_from_camera.to_homogeneous()).norm() < 1e-12
        );
    }

    #[test]
    fn a_model_that_grows_is_fitted_again_until_somebody_takes_hold() {
        let mut view = ViewControl::new(false);
        view.model_is_at(&MODEL);
        let fitted = view.camera((640, 480), None);
        view.model_is_at(&Bounds { radius_m: 0.032, ..MODEL });
        assert_eq!(view.camera((640, 480), None), fitted, "a little is no reason to move");
        view.model_is_at(&Bounds { radius_m: 0.06, ..MODEL });
        assert!(view.camera((640, 480), None).convergence_m > 1.9 * fitted.convergence_m);
        view.turn(0.1, 0.0);
        let held = view.camera((640, 480), None);
        view.model_is_at(&Bounds { radius_m: 0.2, ..MODEL });
        assert_eq!(view.camera((640, 480), None), held);
        view.reset();
        view.model_is_at(&Bounds { radius_m: 0.2, ..MODEL });
        assert_ne!(view.camera((640, 480), None), held);
    }

    #[test]
    fn turning_keeps_the_target_in_the_middle_and_at_its_distance() {
        let mut view = ViewControl::new(false);
        view.model_is_at(&MODEL);
        let before = place_of(&view, &MODEL.center_in_world);
        view.turn(0.3, -0.2);
        let after = place_of(&view, &MODEL.center_in_world);
        assert!((after - before).norm() < 1e-12 && after.xy().coords.norm() < 1e-12, "{after}");
    }

    #[test]
    fn a_drag_takes_the_tissue_with_it() {
        let mut view = ViewControl::new(false);
        view.model_is_at(&MODEL);
        view.pan(0.25, -0.1);
        let camera = view.camera((480, 480), None);
        let seen = camera.pinhole.project(&place_of(&view, &MODEL.center_in_world));
        assert!((seen.x - (239.5 + 120.0)).abs() < 1e-6 && (seen.y - (239.5 - 48.0)).abs() < 1e-6, "{seen}");
    }

    #[test]
    fn zooming_stays_within_sense() {
        let mut view = ViewControl::new(false);
        view.model_is_at(&MODEL);
        view.zoom(1e4);
        assert_eq!(view.camera((4, 3), None).convergence_m, *DISTANCES_M.start());
        view.zoom(-1e4);
        assert_eq!(view.camera((4, 3), None).convergence_m, *DISTANCES_M.end());
    }

    #[test]
    fn following_looks_through_the_scope_until_somebody_takes_hold() {
        let scope = (Pinhole::of_opening((320, 240), 0.6), Pose::translation(0.0, 0.0, 0.05));
        let mut view = ViewControl::new(true);
        view.model_is_at(&MODEL);
        let camera = view.camera((640, 480), Some(&scope));
        assert_eq!((camera.world_from_camera, camera.pinhole.fx_px), (scope.1, scope.0.fx_px * 2.0));
        assert!((camera.convergence_m - 0.05).abs() < 1e-12);
        assert_ne!(
            view.camera((640, 480), None).world_from_camera,
            scope.1,
            "without a scope it shows the model"
        );
        view.zoom(1.0);
        assert!(!view.is_following());
    }

    #[test]
    fn a_given_pose_is_kept_whatever_the_model_does() {
        let pose = Pose::translation(0.1, 0.0, -0.2);
        let mut view = ViewControl::at(&pose, 0.3);
        for radius_m in [0.01, 0.2] {
            view.model_is_at(&Bounds { radius_m, ..MODEL });
            let camera = view.camera((640, 480), None);
            assert!((camera.world_from_camera.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-12);
        }
    }
}
