//! Whether features followed on deforming tissue moved as the tissue did.

use std::collections::BTreeMap;

use geometry::{Pose, StereoRig};
use nalgebra::{Point2, Point3, Vector2};
use simulator::{SceneConfig, SceneKind};
use tracking::TrackedFeature;

use crate::Error;
use crate::footage::Footage;
use crate::row::{Measured, Row};
use crate::run::{Recording, Tracked, track_all};
use crate::settings::Settings;

/// A feature is compared with the nearest true point within this, px.
const NEAR_PX: f32 = 5.0;
/// A step further off than this is wrong, px.
const WRONG_PX: f32 = 2.0;
const RIGHT_SHARE_MIN: f64 = 0.95;

/// The row.
pub fn rows() -> Vec<Row> {
    vec![Row {
        name: "deformation correspondences",
        target: "95 % of the steps within 2 px of the tissue's",
        anchor: "none published",
        measure,
    }]
}

#[derive(Default)]
struct Tally {
    steps: usize,
    right: usize,
}

impl Tally {
    fn share(&self) -> f64 {
        self.right as f64 / self.steps.max(1) as f64
    }
}

fn measure(footage: &Footage, settings: &Settings) -> Result<Measured, Error> {
    let scene = SceneConfig { scene: SceneKind::Liver, ..settings.scene.clone() };
    let path = footage.simulated("deforming-liver", &scene)?;
    let recording = Recording::open(&path, &settings.recording)?;
    let frames = track_all("deformation", &recording, &settings.tracking)?;
    let truth = TruePixels::read(&recording)?;
    let (mut rigid, mut deforming) = (Tally::default(), Tally::default());
    for pair in frames.windows(2) {
        let [before, after] = pair else { continue };
        let Some(moves) = truth.moves(before, after) else { continue };
        for feature in &after.report.features {
            let Some((is_rigid, error_px)) = step_error_px(feature, &moves) else { continue };
            let tally = if is_rigid { &mut rigid } else { &mut deforming };
            tally.steps += 1;
            tally.right += usize::from(error_px <= WRONG_PX);
        }
    }
    let text = format!(
        "deforming: {} steps, {:.1} % right; rigid: {} steps, {:.1} % right",
        deforming.steps,
        100.0 * deforming.share(),
        rigid.steps,
        100.0 * rigid.share()
    );
    Ok(Measured::new(text, deforming.share() >= RIGHT_SHARE_MIN && rigid.share() >= RIGHT_SHARE_MIN))
}

/// Where a true point was and is, px.
type Move = (Point2<f32>, Point2<f32>);

/// Difference of the feature's step from that of the nearest true point.
fn step_error_px(feature: &TrackedFeature, moves: &[Move]) -> Option<(bool, f32)> {
    let motion = feature.motion?;
    let distance_px = |(_, now): &&Move| (now - feature.pixel).norm();
    let (was, is) = moves.iter().min_by(|a, b| distance_px(a).total_cmp(&distance_px(b)))?;
    let near = (is - feature.pixel).norm() <= NEAR_PX;
    let error: Vector2<f32> = (feature.pixel - motion.previous_pixel) - (is - was);
    near.then(|| (motion.rigid, error.norm()))
}

/// The true points and poses of a recording.
struct TruePixels {
    rig: StereoRig,
    poses: BTreeMap<u64, Pose>,
    points: BTreeMap<u64, Vec<Point3<f64>>>,
}

impl TruePixels {
    fn read(recording: &Recording) -> Result<Self, Error> {
        let poses = recording.reader().poses()?;
        let poses = poses.into_iter().map(|pose| (pose.stamp_ns, pose.world_from_camera)).collect();
        let mut points = BTreeMap::new();
        for at in recording.reader().points()? {
            let at = at?;
            points.insert(at.stamp_ns, at.points_in_world);
        }
        Ok(Self { rig: recording.rig, poses, points })
    }

    /// Points in front of the camera at both times. Hidden ones are among them: they move much as what hides them does.
    fn moves(&self, before: &Tracked, after: &Tracked) -> Option<Vec<Move>> {
        let pixels = |stamp_ns: u64| -> Option<Vec<Option<Point2<f32>>>> {
            let camera_from_world = self.poses.get(&stamp_ns)?.inverse();
            let project = |point: &Point3<f64>| {
                let point = camera_from_world * point;
                (point.z > 0.0).then(|| self.rig.left.project(&point).cast())
            };
            Some(self.points.get(&stamp_ns)?.iter().map(project).collect())
        };
        let both = pixels(before.stamp_ns)?.into_iter().zip(pixels(after.stamp_ns)?);
        Some(both.filter_map(|(was, is)| Some((was?, is?))).collect())
    }
}
