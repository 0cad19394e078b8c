//! Local bundle adjustment: the window's poses and the points that they see, all at once.
//!
//! Tissue moves, so a point is held by its latest sightings only, and counts as far as it has stood still (its trust). A keyframe
//! at rest is not adjusted: that the camera did not move is known better than what moving tissue suggests.

use std::collections::BTreeMap;

use geometry::StereoRig;

use super::edit::Edit;
use super::window::Window;
use crate::config::TrackingConfig;
use crate::map::{KeyframeId, Map, MapPoint, PointId};
use crate::optimize::bundle::{Bundle, BundleCamera, BundlePoint, BundleSighting};

/// Adjusts a window of the map: new poses, new positions, and the sightings that fit neither.
pub fn adjust(
    map: &Map,
    window: &Window,
    rig: &StereoRig,
    scales: &[f32],
    config: &TrackingConfig,
) -> Vec<Edit> {
    let (mut bundle, names) = assemble(map, window, scales, config);
    for _ in 0..config.mapping.adjustment_rounds {
        bundle.classify(rig);
        bundle.minimise(rig, config.mapping.adjustment_steps);
    }
    bundle.classify(rig);
    names.edits(&bundle)
}

/// What the parts of a bundle are in the map.
struct Names {
    keyframes: Vec<KeyframeId>,
    points: Vec<PointId>,
}

impl Names {
    fn edits(&self, bundle: &Bundle) -> Vec<Edit> {
        let moved = self.keyframes.iter().zip(&bundle.cameras).filter(|(_, camera)| !camera.fixed);
        let mut edits: Vec<Edit> = moved
            .map(|(&keyframe, camera)| Edit::MoveKeyframe {
                keyframe,
                camera_from_world: camera.camera_from_world,
            })
            .collect();
        for (&point, adjusted) in self.points.iter().zip(&bundle.points) {
            if adjusted.sightings.iter().any(|sighting| sighting.used) {
                edits.push(Edit::MovePoint { point, position_in_world: adjusted.position_in_world });
            }
            let wrong = adjusted.sightings.iter().filter(|sighting| !sighting.used);
            edits.extend(
                wrong.map(|sighting| Edit::Unlink { point, keyframe: self.keyframes[sighting.camera] }),
            );
        }
        edits
    }
}

fn assemble(map: &Map, window: &Window, scales: &[f32], config: &TrackingConfig) -> (Bundle, Names) {
    let mut names = Names { keyframes: Vec::new(), points: Vec::new() };
    let mut bundle = Bundle::default();
    let oldest = map.keyframes().next().map(|(id, _)| id);
    for id in window.all() {
        let Some(keyframe) = map.keyframe(id) else { continue };
        let fixed = keyframe.resting || Some(id) == oldest || window.fixed.contains(&id);
        bundle.cameras.push(BundleCamera { camera_from_world: keyframe.camera_from_world, fixed });
        names.keyframes.push(id);
    }
    let places: BTreeMap<KeyframeId, usize> =
        names.keyframes.iter().enumerate().map(|(place, id)| (*id, place)).collect();
    for (id, point) in map.points() {
        let sightings = latest_sightings(map, point, &places, scales, config);
        if sightings.len() >= 2 {
            bundle.points.push(BundlePoint {
                position_in_world: point.position_in_world,
                trust: point.trust(),
                sightings,
            });
            names.points.push(id);
        }
    }
    (bundle, names)
}

fn latest_sightings(
    map: &Map,
    point: &MapPoint,
    places: &BTreeMap<KeyframeId, usize>,
    scales: &[f32],
    config: &TrackingConfig,
) -> Vec<BundleSighting> {
    let sighting = |seen: &crate::map::Seen| {
        let camera = *places.get(&seen.keyframe)?;
        let observation = map.keyframe(seen.keyframe)?.frame.observation(seen.feature, scales, &config.pose);
        Some(BundleSighting { camera, observation, used: true })
    };
    point.seen().iter().rev().filter_map(sighting).take(config.map.refine_observations as usize).collect()
}
