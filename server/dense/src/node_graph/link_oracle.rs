//! CPU mirror of `link_nodes.wgsl` and `join_edges.wgsl`: nearest neighbours by brute force.

use std::collections::BTreeSet;

use gpu::{FrameRecorder, StageTimer};
use nalgebra::Vector3;

use super::store::{EDGES, NEAREST};
use super::{NodeFinder, NodeStore, join_edges, link_nodes};
use crate::testing::{Numbers, config, gpu};

/// Every other slot of a capacity is a node, at random places.
fn scattered(capacity: u32, seed: u64) -> Vec<Option<Vector3<f32>>> {
    let mut numbers = Numbers::new(seed);
    (0..capacity)
        .map(|slot| {
            let point = numbers.vector().map(|x| (0.02 * x) as f32);
            (slot % 2 == 1).then_some(point)
        })
        .collect()
}

fn nearest(points: &[Option<Vector3<f32>>], own: usize, reach_m: f32) -> Vec<usize> {
    let Some(point) = points[own] else { return Vec::new() };
    let mut near: Vec<(f32, usize)> = (0..points.len())
        .filter(|&slot| slot != own)
        .filter_map(|slot| points[slot].map(|other| ((other - point).norm_squared(), slot)))
        .filter(|(square, _)| *square < 4.0 * reach_m * reach_m)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.iter().take(NEAREST).map(|(_, slot)| *slot).collect()
}

fn edges(points: &[Option<Vector3<f32>>], reach_m: f32) -> Vec<Vec<u32>> {
    let near: Vec<Vec<usize>> = (0..points.len()).map(|own| nearest(points, own, reach_m)).collect();
    let accepted = |node: usize| -> BTreeSet<usize> {
        (0..points.len()).filter(|&other| near[other].contains(&node)).take(12).collect()
    };
    let accepted: Vec<BTreeSet<usize>> = (0..points.len()).map(accepted).collect();
    let row = |own: usize| -> Vec<u32> {
        let out = near[own].iter().copied().filter(|&other| accepted[other].contains(&own));
        let all: BTreeSet<usize> = out.chain(accepted[own].iter().copied()).collect();
        all.into_iter().map(|slot| slot as u32).collect()
    };
    (0..points.len()).map(row).collect()
}

#[test]
fn edges_join_nearest_neighbours_both_ways() {
    let gpu = gpu();
    let mut config = config().nodes;
    config.capacity = 256;
    let nodes = NodeStore::new(&gpu, &config).unwrap();
    let points = scattered(config.capacity, 5);
    let row = |(slot, point): (usize, &Option<Vector3<f32>>)| match point {
        Some(point) => [point.x.to_bits(), point.y.to_bits(), point.z.to_bits(), slot as u32 + 1],
        None => [0; 4],
    };
    let rows: Vec<[u32; 4]> = points.iter().enumerate().map(row).collect();
    gpu.write(&nodes.rows, 0, &rows).unwrap();
    let finder = NodeFinder::new(&gpu, &nodes.settings, &nodes.rows, &nodes.hash).unwrap();
    let passes = [link_nodes::bind(&gpu, &nodes).unwrap(), join_edges::bind(&gpu, &nodes).unwrap()];
    let timer = StageTimer::new(&gpu, 4).unwrap();
    let mut frame = FrameRecorder::begin(&gpu, &timer);
    finder.record(&mut frame).unwrap();
    frame.clear(&nodes.follower_counts);
    let all = [config.capacity, 1, 1];
    frame.stage("edges", |stage| passes.iter().try_for_each(|pass| stage.run(pass, all))).unwrap();
    frame.submit().collect().unwrap();
    let found = gpu.read(&nodes.edges).unwrap();
    let expected = edges(&points, 2e-3 * config.spacing_mm as f32);
    assert!(expected.iter().map(Vec::len).sum::<usize>() > 1000);
    for (slot, expected) in expected.iter().enumerate() {
        let mut row = found[EDGES * slot..EDGES * (slot + 1)].to_vec();
        row.retain(|&other| other != u32::MAX);
        assert_eq!(row, *expected, "slot {slot}");
        assert!(row.iter().all(|&other| expected.contains(&other)));
    }
}
