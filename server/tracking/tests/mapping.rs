//! Mapping on worlds without images: places, loops, fusion, two-view points, local bundle adjustment.

mod support;
#[path = "support/world.rs"]
mod world;

use geometry::{Pose, se3};
use nalgebra::{Translation3, Vector3, Vector6};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use tracking::local_mapping::edit::apply;
use tracking::local_mapping::{Window, adjustment, fusion, triangulation};
use tracking::loop_closing::{close, suspect};
use tracking::map::{KeyframeId, Map, covisible};
use tracking::relocalization::{PlaceIndex, candidates};
use world::{Inserter, World, context};

/// A camera moved sideways, looking along z.
fn at(x_m: f64, y_m: f64) -> Pose {
    Pose::translation(-x_m, -y_m, 0.0)
}

/// Cameras around a square of 80 mm, the last one nearly where the first is.
fn square() -> Vec<Pose> {
    let side = |from: (f64, f64), step: (f64, f64)| {
        (0..8).map(move |index| at(from.0 + step.0 * f64::from(index), from.1 + step.1 * f64::from(index)))
    };
    side((0.0, 0.0), (0.01, 0.0))
        .chain(side((0.08, 0.0), (0.0, 0.01)))
        .chain(side((0.08, 0.08), (-0.01, 0.0)))
        .chain(side((0.0, 0.08), (0.0, -0.01)))
        .collect()
}

fn distance_m(a: &Pose, b: &Pose) -> f64 {
    (a.inverse().translation.vector - b.inverse().translation.vector).norm()
}

/// A map that drifted on its way around a square and does not know that it is back.
fn drifted_square() -> (Map, Vec<KeyframeId>, PlaceIndex) {
    let context = context();
    let (mut world, mut map, mut places) = (World::new(6000, 3), Map::default(), PlaceIndex::new());
    let mut inserter = Inserter::new(3);
    let ids: Vec<KeyframeId> = square()
        .iter()
        .enumerate()
        .map(|(index, truth)| {
            let drift = Translation3::from(Vector3::new(1e-4, -0.5e-4, 0.5e-4) * index as f64);
            let seen = world.look(&context.rig, truth);
            let id = inserter.insert(&mut map, &seen, &(drift * truth), &context);
            let keyframe = map.keyframe(id).expect("just inserted");
            places.insert(id, || keyframe.mapped_descriptors());
            id
        })
        .collect();
    (map, ids, places)
}

#[test]
fn a_loop_is_suspected_proven_and_closed() {
    let context = context();
    let (mut map, ids, places) = drifted_square();
    let (first, last) = (ids[0], ids[ids.len() - 1]);
    let truth = square();
    let truth = &truth[ids.len() - 1];
    let drift_m = distance_m(&map.keyframe(last).expect("kept").camera_from_world, truth);
    assert!(covisible(&map, last).iter().all(|(other, _)| *other != first));

    let suspicion = suspect(&map, &places, last, &context.config).expect("the first keyframe looks alike");
    let keyframe = map.keyframe(last).expect("kept");
    let closure = suspicion.prove(last, keyframe, &context).expect("the loop is real");
    assert!(distance_m(&closure.camera_from_world, truth) < 0.3 * drift_m);

    let points_before = map.point_count();
    let corrections = close(&mut map, &closure, &context);
    assert_eq!(corrections.len(), ids.len());
    let left_m = distance_m(&map.keyframe(last).expect("kept").camera_from_world, truth);
    assert!(left_m < 0.5 * drift_m, "{left_m} m of {drift_m} m are left");
    assert_eq!(map.keyframe(first).expect("kept").camera_from_world, at(0.0, 0.0));
    assert!(covisible(&map, last).iter().any(|(other, count)| *other == first && *count > 50));
    assert!(map.point_count() < points_before);
    assert_eq!(map.loops().collect::<Vec<_>>(), [(last, closure.old)]);
}

#[test]
fn a_place_never_seen_closes_no_loop() {
    let context = context();
    let (mut map, _, places) = drifted_square();
    // another world at the same place
    let seen = World::new(6000, 99).look(&context.rig, &at(0.04, 0.04));
    let id = Inserter::new(0).insert(&mut map, &seen, &at(0.5, 0.5), &context);
    let keyframe = map.keyframe(id).expect("just inserted");
    let proven = suspect(&map, &places, id, &context.config)
        .and_then(|suspicion| suspicion.prove(id, keyframe, &context));
    assert_eq!(proven, None);
}

#[test]
fn revisited_places_are_recognised_precisely_and_mostly() {
    let context = context();
    let (map, ids, places) = drifted_square();
    let (mut world, mut elsewhere) = (World::new(6000, 3), World::new(6000, 77));
    (world.noise_bits, elsewhere.noise_bits) = (35, 35);
    let mut random = Pcg64Mcg::new(1);
    let share_min = context.config.loops.share_min;
    let best = |world: &mut World, pose: &Pose| {
        let seen = world.look(&context.rig, pose);
        let bits = context.config.recognition.distance_max_bits;
        let found = candidates(&places, &map, &seen.frame.features.descriptors, bits, |_| true);
        found
            .first()
            .filter(|candidate| candidate.group_share >= share_min)
            .map(|candidate| candidate.keyframe)
    };
    let (mut right, mut wrong, mut visits) = (0, 0, 0);
    for truth in square() {
        // up to 15 mm and 30 degrees beside the path: about two thirds of the view are the same
        let turn = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, random.random_range(-0.5..0.5));
        let aside =
            Pose::translation(random.random_range(-0.015..0.015), random.random_range(-0.015..0.015), 0.0);
        let pose = se3::exp(&turn) * aside * truth;
        visits += 1;
        if let Some(found) = best(&mut world, &pose) {
            let place = ids.iter().position(|id| *id == found).expect("a keyframe of the map");
            let near = distance_m(&square()[place], &pose) < 0.05;
            (right, wrong) = (right + u32::from(near), wrong + u32::from(!near));
        }
        wrong += u32::from(best(&mut elsewhere, &pose).is_some());
    }
    let precision = f64::from(right) / f64::from(right + wrong);
    let recall = f64::from(right) / f64::from(visits);
    eprintln!("place recognition on a simulated revisit: precision {precision:.3}, recall {recall:.3}");
    assert!(precision > 0.95 && recall > 0.95, "precision {precision}, recall {recall}");
}

#[test]
fn what_two_keyframes_named_twice_becomes_one() {
    let context = context();
    let (mut world, mut map) = (World::new(6000, 5), Map::default());
    let poses = [at(0.0, 0.0), at(0.004, 0.0)];
    let ids = poses.map(|pose| {
        let seen = world.look(&context.rig, &pose);
        // nothing is remembered, so each keyframe makes points of its own
        Inserter::new(0).insert(&mut map, &seen, &pose, &context)
    });
    let before = map.point_count();
    let points = fusion::points_made_by(&map, ids[1]);
    let rig = (&context.rig, context.scales.as_slice());
    let edits = fusion::fuse(&map, &points, ids[0], rig, &context.config);
    apply(&mut map, &fusion::resolve_chains(edits), &mut Vec::new(), &context.scales);
    let shared = covisible(&map, ids[1]).first().map_or(0, |(_, count)| *count) as usize;
    assert!(shared * 10 > before / 2 * 7, "{shared} of {}", before / 2);
    assert_eq!(map.point_count(), before - shared);
}

#[test]
fn features_without_depth_become_points_by_two_views() {
    let context = context();
    let (mut world, mut map) = (World::new(6000, 6), Map::default());
    world.stereo_reach_m = 0.0;
    let poses = [at(0.0, 0.0), at(0.01, 0.002)];
    let ids = poses.map(|pose| {
        let seen = world.look(&context.rig, &pose);
        Inserter::new(0).insert(&mut map, &seen, &pose, &context)
    });
    assert_eq!(map.point_count(), 0);
    let rig = (&context.rig, context.scales.as_slice());
    let edits = triangulation::triangulate(&map, (ids[1], ids[0]), rig, &context.config);
    apply(&mut map, &edits, &mut Vec::new(), &context.scales);
    assert!(map.point_count() > 100, "{} points", map.point_count());
    let deep = map.points().filter(|(_, point)| (0.065..0.095).contains(&point.position_in_world.z)).count();
    assert!(deep * 100 > map.point_count() * 98, "{deep} of {} at the right depth", map.point_count());
}

#[test]
fn local_bundle_adjustment_finds_a_disturbed_keyframe_s_place() {
    let context = context();
    let (mut world, mut map) = (World::new(6000, 8), Map::default());
    let mut inserter = Inserter::new(10);
    let truths: Vec<Pose> = (0..6).map(|index| at(0.004 * f64::from(index), 0.0)).collect();
    let ids: Vec<KeyframeId> = truths
        .iter()
        .map(|truth| {
            let seen = world.look(&context.rig, truth);
            inserter.insert(&mut map, &seen, truth, &context)
        })
        .collect();
    let disturbance = se3::exp(&Vector6::new(3e-4, -2e-4, 2e-4, 2e-3, -1e-3, 1e-3));
    let newest = ids[5];
    *map.keyframe_pose_mut(newest).expect("kept") = disturbance * truths[5];
    let window = Window::around(&map, newest, &context.config.mapping);
    let edits = adjustment::adjust(&map, &window, &context.rig, &context.scales, &context.config);
    apply(&mut map, &edits, &mut Vec::new(), &context.scales);
    let left_m = distance_m(&map.keyframe(newest).expect("kept").camera_from_world, &truths[5]);
    let disturbed_m = distance_m(&(disturbance * truths[5]), &truths[5]);
    assert!(left_m < 0.6 * disturbed_m, "{left_m} m of {disturbed_m} m are left");

    map.set_resting(newest, true);
    *map.keyframe_pose_mut(newest).expect("kept") = disturbance * truths[5];
    let edits = adjustment::adjust(&map, &window, &context.rig, &context.scales, &context.config);
    apply(&mut map, &edits, &mut Vec::new(), &context.scales);
    assert_eq!(map.keyframe(newest).expect("kept").camera_from_world, disturbance * truths[5]);
}
