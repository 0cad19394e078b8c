//! Takes the drift out: poses by a graph over the keyframes, points with the keyframe that made them, duplicates merged.

use std::collections::BTreeMap;

use geometry::Pose;

use super::detection::LoopClosure;
use crate::local_mapping::MappingContext;
use crate::local_mapping::edit::{Edit, apply};
use crate::local_mapping::fusion::{fuse, resolve_chains};
use crate::map::{KeyframeId, Map, PointId, Seen, covisible, local_map};
use crate::optimize::pose_graph::{GraphEdge, GraphNode, PoseGraph};
use crate::report::KeyframeCorrection;

/// Steps of the pose graph.
const STEPS_MAX: u32 = 20;
/// Neighbours of the new keyframe in which the old points are looked for.
const NEIGHBOURS: usize = 6;

/// Closes a loop. Gives where each keyframe was and is; empty where the keyframes of the closure are gone.
pub fn close(map: &mut Map, closure: &LoopClosure, context: &MappingContext) -> Vec<KeyframeCorrection> {
    if map.keyframe(closure.keyframe).is_none() || map.keyframe(closure.old).is_none() {
        return Vec::new();
    }
    let (mut graph, names) = essential_graph(map, closure, context);
    graph.minimise(STEPS_MAX);
    let after: BTreeMap<KeyframeId, Pose> =
        names.into_iter().zip(graph.nodes).map(|(id, node)| (id, node.camera_from_world)).collect();
    let corrections = map.keyframes().filter_map(|(id, keyframe)| {
        Some(KeyframeCorrection {
            stamp_ns: keyframe.stamp_ns,
            world_from_camera_before: keyframe.camera_from_world.inverse(),
            world_from_camera_after: after.get(&id)?.inverse(),
        })
    });
    let corrections = corrections.collect();
    map.move_keyframes(&after);
    join(map, closure, context);
    map.note_loop(closure.keyframe, closure.old);
    corrections
}

/// Spanning tree, pairs that share many points, earlier loops, and the new one: motions as they are now, but for the new one's.
fn essential_graph(
    map: &Map,
    closure: &LoopClosure,
    context: &MappingContext,
) -> (PoseGraph, Vec<KeyframeId>) {
    let names: Vec<KeyframeId> = map.keyframes().map(|(id, _)| id).collect();
    let places: BTreeMap<KeyframeId, usize> =
        names.iter().enumerate().map(|(place, id)| (*id, place)).collect();
    let nodes: Vec<GraphNode> = map
        .keyframes()
        .enumerate()
        .map(|(place, (_, keyframe))| GraphNode {
            camera_from_world: keyframe.camera_from_world,
            fixed: place == 0,
        })
        .collect();
    let mut edges = Vec::new();
    let mut add = |from: usize, to: usize, weight: u32| {
        let to_from_from = nodes[to].camera_from_world * nodes[from].camera_from_world.inverse();
        edges.push(GraphEdge { from, to, to_from_from, weight: f64::from(weight.max(1)) });
    };
    for (id, keyframe) in map.keyframes() {
        let shared = covisible(map, id);
        let count =
            |other: KeyframeId| shared.iter().find(|(id, _)| *id == other).map_or(0, |(_, count)| *count);
        if let Some(parent) = keyframe.parent().filter(|parent| places.contains_key(parent)) {
            add(places[&parent], places[&id], count(parent));
        }
        let strong = shared.iter().filter(|(other, count)| {
            *other < id
                && Some(*other) != keyframe.parent()
                && *count >= context.config.loops.essential_points_min
        });
        for (other, count) in strong {
            add(places[other], places[&id], *count);
        }
    }
    for (a, b) in map.loops() {
        add(places[&b], places[&a], closure.matches.len() as u32);
    }
    let old = places[&closure.old];
    let to_from_from = closure.camera_from_world * nodes[old].camera_from_world.inverse();
    let weight = closure.matches.len() as f64;
    edges.push(GraphEdge { from: old, to: places[&closure.keyframe], to_from_from, weight });
    let depth_m = map.keyframe(closure.keyframe).and_then(|keyframe| keyframe.frame.median_depth_m());
    let length_scale_m = depth_m.unwrap_or(1.0);
    (PoseGraph { nodes, edges, length_scale_m }, names)
}

/// Makes one of what the new keyframe and its neighbours see a second time.
fn join(map: &mut Map, closure: &LoopClosure, context: &MappingContext) {
    let mut made = Vec::new();
    let Some(newest) = map.keyframe(closure.keyframe) else { return };
    let same = closure.matches.iter().filter_map(|&(feature, old)| match newest.points().get(feature)? {
        Some(other) if *other == old => None,
        Some(other) => Some(Edit::Merge { kept: old, duplicate: *other }),
        None => Some(Edit::Link { point: old, seen: Seen { keyframe: closure.keyframe, feature } }),
    });
    let same = resolve_chains(same.collect());
    apply(map, &same, &mut made, &context.scales);
    let near_old = map.keyframe(closure.old).map(|old| old.points().to_vec()).unwrap_or_default();
    let old_points: Vec<PointId> =
        local_map(map, near_old.into_iter().flatten(), NEIGHBOURS).points.into_iter().collect();
    let neighbours: Vec<KeyframeId> =
        covisible(map, closure.keyframe).into_iter().take(NEIGHBOURS).map(|(id, _)| id).collect();
    for neighbour in neighbours {
        let rig = (&context.rig, context.scales.as_slice());
        let found = fuse(map, &old_points, neighbour, rig, &context.config);
        apply(map, &resolve_chains(found), &mut made, &context.scales);
    }
}
