//! The surface that a model is compared with.

use geometry::{DepthMap, Pinhole, Pose};
use nalgebra::{Point2, Point3};

use crate::EvaluationError;
use crate::mesh::Mesh;
use crate::truth::Truth;

/// Frames in which a part of the surface must have been seen to be expected in the model.
const SEEN_FRAMES_MIN: u32 = 3;
/// Neighbouring depths that differ by more than this share of their mean belong to different surfaces.
const DEPTH_STEP_MAX: f64 = 0.02;
/// A model point this far (m) behind the true depth is hidden by it.
const HIDDEN_BEHIND_M: f64 = 0.02;
/// Pixels at the border of the view that are left out, at the low and at the high end.
const BORDER_PX: (f64, f64) = (2.0, 3.0);

/// The true surface of the last frame, in world.
pub(super) struct Reference {
    pub mesh: Mesh,
    /// What it was made of.
    pub source: &'static str,
    /// Faces that a model is expected to cover; all where empty.
    seen: Vec<bool>,
    view: Option<View>,
}

/// The last frame's view, where the surface is known in that view only.
struct View {
    pinhole: Pinhole,
    depth: DepthMap,
    camera_from_world: Pose,
}

impl Reference {
    /// The simulator's mesh, or else the surface that the true depth of the last frame shows.
    pub(super) fn of(truth: &Truth<'_>) -> Result<Option<Self>, EvaluationError> {
        let Some(moving) = &truth.mesh else { return Self::of_last_depth(truth) };
        let recorded = moving.vertices(truth.last_frame())?;
        let vertices: Vec<_> = recorded.iter().map(|vertex| truth.world_from_recorded * vertex).collect();
        Ok(Some(Self {
            mesh: Mesh::new(&vertices, &moving.faces)?,
            source: "true mesh",
            seen: (0..moving.faces.len()).map(|face| moving.face_is_seen(face, SEEN_FRAMES_MIN)).collect(),
            view: None,
        }))
    }

    fn of_last_depth(truth: &Truth<'_>) -> Result<Option<Self>, EvaluationError> {
        let last = truth.last_frame();
        let Some(world_from_camera) = truth.world_from_camera(last) else { return Ok(None) };
        let mut depth = None;
        for candidate in truth.depths()? {
            let candidate = candidate?;
            if candidate.stamp_ns == truth.frame_stamps_ns[last] {
                depth = Some(candidate.depth);
            }
        }
        let Some(depth) = depth else { return Ok(None) };
        let pinhole = truth.left_pinhole()?;
        let (vertices, faces) = triangulated(&depth, &pinhole, &world_from_camera);
        if faces.is_empty() {
            return Ok(None);
        }
        Ok(Some(Self {
            mesh: Mesh::new(&vertices, &faces)?,
            source: "truth depth of the last frame",
            seen: Vec::new(),
            view: Some(View { pinhole, depth, camera_from_world: world_from_camera.inverse() }),
        }))
    }

    /// Whether a face is expected in the model.
    pub(super) fn is_seen(&self, face: usize) -> bool {
        self.seen.get(face).copied().unwrap_or(true)
    }

    /// The model's points that lie where the reference is known.
    pub(super) fn comparable(&self, mut points: Vec<Point3<f64>>) -> Vec<Point3<f64>> {
        if let Some(view) = &self.view {
            points.retain(|point| view.sees(point));
        }
        points
    }
}

impl View {
    fn sees(&self, point_in_world: &Point3<f64>) -> bool {
        let point = self.camera_from_world * point_in_world;
        if point.z <= 0.0 {
            return false;
        }
        let pixel = self.pinhole.project(&point);
        let (width, height) = (f64::from(self.depth.width()), f64::from(self.depth.height()));
        let inside = pixel.x >= BORDER_PX.0
            && pixel.y >= BORDER_PX.0
            && pixel.x < width - BORDER_PX.1
            && pixel.y < height - BORDER_PX.1;
        let depth_m = self.depth.get(pixel.x.round_ties_even() as i64, pixel.y.round_ties_even() as i64);
        let depth_m = depth_m.copied().map_or(0.0, f64::from);
        inside && depth_m > 0.0 && point.z < depth_m + HIDDEN_BEHIND_M
    }
}

/// Two faces between each four neighbouring pixels that lie on one surface.
fn triangulated(
    depth: &DepthMap,
    pinhole: &Pinhole,
    world_from_camera: &Pose,
) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let (width, height) = depth.size();
    let mut vertices = Vec::with_capacity(depth.pixels().len());
    for y in 0..height {
        vertices.extend((0..width).map(|x| {
            let pixel = Point2::new(f64::from(x), f64::from(y));
            world_from_camera * pinhole.back_project(&pixel, f64::from(depth[(x, y)]))
        }));
    }
    let corners: Vec<u32> = (0..height.saturating_sub(1))
        .flat_map(|y| (0..width.saturating_sub(1)).map(move |x| y * width + x))
        .collect();
    let upper = corners.iter().map(|&corner| [corner, corner + 1, corner + width]);
    let lower = corners.iter().map(|&corner| [corner + 1, corner + width + 1, corner + width]);
    let faces =
        upper.chain(lower).filter(|face| is_one_surface(face.map(|pixel| depth.pixels()[pixel as usize])));
    (vertices, faces.collect())
}

fn is_one_surface(depths_m: [f32; 3]) -> bool {
    let depths_m = depths_m.map(f64::from);
    let nearest = depths_m.iter().copied().fold(f64::INFINITY, f64::min);
    let farthest = depths_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = depths_m.iter().sum::<f64>() / 3.0;
    nearest > 0.0 && farthest - nearest < DEPTH_STEP_MAX * mean
}
