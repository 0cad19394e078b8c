//! What mapping changes: a list, so that it can be worked out beside the tracker and carried out between two frames.

use geometry::Pose;
use nalgebra::Point3;

use crate::map::{KeyframeId, Map, PointId, Seen};

/// One change of the map. What it speaks of may be gone by the time it is carried out; nothing happens then.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// A new point and its first two or more sightings. The n-th of a list has the n-th provisional id in later edits.
    Add {
        /// Where it is.
        position_in_world: Point3<f64>,
        /// Who sees it.
        seen: Vec<Seen>,
    },
    /// A sighting that tracking missed.
    Link {
        /// What is seen.
        point: PointId,
        /// By whom.
        seen: Seen,
    },
    /// Two points are one.
    Merge {
        /// Stays, with the sightings of both.
        kept: PointId,
        /// Goes.
        duplicate: PointId,
    },
    /// A sighting that was wrong.
    Unlink {
        /// What is not seen.
        point: PointId,
        /// By whom.
        keyframe: KeyframeId,
    },
    /// A better position.
    MovePoint {
        /// Whose.
        point: PointId,
        /// Where to.
        position_in_world: Point3<f64>,
    },
    /// A better pose.
    MoveKeyframe {
        /// Whose.
        keyframe: KeyframeId,
        /// Where it is.
        camera_from_world: Pose,
    },
}

/// Carries out edits; `made` holds the points that earlier `Add`s of the same work made, and grows.
pub fn apply(map: &mut Map, edits: &[Edit], made: &mut Vec<Option<PointId>>, scales: &[f32]) {
    for edit in edits {
        if let Some(changed) = apply_one(map, edit, made) {
            map.summarise_point(changed, scales);
        }
    }
}

/// Gives the point whose looks have changed.
fn apply_one(map: &mut Map, edit: &Edit, made: &mut Vec<Option<PointId>>) -> Option<PointId> {
    let resolved = |id: &PointId| match id.provisional_index() {
        Some(index) => made.get(index).copied().flatten(),
        None => Some(*id),
    };
    match edit {
        Edit::Add { position_in_world, seen } => {
            let id = add(map, position_in_world, seen);
            made.push(id);
            id
        }
        Edit::Link { point, seen } => {
            let id = resolved(point)?;
            map.link(id, *seen);
            Some(id)
        }
        Edit::Merge { kept, duplicate } => {
            let (kept, duplicate) = (resolved(kept)?, resolved(duplicate)?);
            map.merge_points(kept, duplicate);
            Some(kept)
        }
        Edit::Unlink { point, keyframe } => {
            let id = resolved(point)?;
            map.unlink(id, *keyframe);
            Some(id)
        }
        Edit::MovePoint { point, position_in_world } => {
            map.point_mut(resolved(point)?)?.position_in_world = *position_in_world;
            None
        }
        Edit::MoveKeyframe { keyframe, camera_from_world } => {
            *map.keyframe_pose_mut(*keyframe)? = *camera_from_world;
            None
        }
    }
}

fn add(map: &mut Map, position_in_world: &Point3<f64>, seen: &[Seen]) -> Option<PointId> {
    let (first, others) = seen.split_first()?;
    let id = map.add_point(*position_in_world, *first)?;
    for other in others {
        map.link(id, *other);
    }
    Some(id)
}
