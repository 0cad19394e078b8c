//! CPU mirror of `shared/binding.wgsl`: the rule by brute force over all nodes.

use nalgebra::Vector3;

use crate::testing::Numbers;

/// A node: position, id.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OracleNode {
    pub point: Vector3<f64>,
    pub id: u32,
}

/// The nodes (by their index) that move `point`, with their weights.
pub(crate) fn bind(point: &Vector3<f64>, nodes: &[OracleNode], reach_m: f64) -> Vec<(usize, f64)> {
    let mut near: Vec<(f64, u32, usize)> = (nodes.iter().enumerate())
        .map(|(index, node)| ((node.point - point).norm(), node.id, index))
        .filter(|(distance_m, ..)| *distance_m < reach_m)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let outer_m = 1.001 * near.get(4).map_or(reach_m, |fifth| fifth.0) + 1e-6;
    near.truncate(4);
    let sum: f64 = near.iter().map(|(distance_m, ..)| 1.0 - distance_m / outer_m).sum();
    near.iter().map(|(distance_m, _, index)| (*index, (1.0 - distance_m / outer_m) / sum)).collect()
}

fn scattered(count: u32) -> Vec<OracleNode> {
    let mut numbers = Numbers::new(9);
    (0..count).map(|id| OracleNode { point: 0.01 * numbers.vector(), id }).collect()
}

/// Weight of each node at `point`.
fn weights(point: &Vector3<f64>, nodes: &[OracleNode]) -> Vec<f64> {
    let mut all = vec![0.0; nodes.len()];
    bind(point, nodes, 0.008).into_iter().for_each(|(index, weight)| all[index] = weight);
    all
}

#[test]
fn weights_sum_to_one_and_do_not_jump_where_neighbours_swap() {
    let nodes = scattered(40);
    let (start, step) = (Vector3::new(-0.01, 0.002, 0.001), Vector3::new(2e-6, 0.0, 0.0));
    let mut before = weights(&start, &nodes);
    let mut swaps = 0;
    for number in 1..10_000 {
        let now = weights(&(start + step * f64::from(number)), &nodes);
        assert!((now.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let jump = now.iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(jump < 6e-3, "{jump} at step {number}");
        swaps += usize::from(now.iter().zip(&before).any(|(a, b)| (*a == 0.0) != (*b == 0.0)));
        before = now;
    }
    assert!(swaps > 4, "{swaps}");
}

#[test]
fn a_lone_node_moves_what_is_in_its_reach_and_nothing_else() {
    let node = [OracleNode { point: Vector3::zeros(), id: 3 }];
    assert_eq!(bind(&Vector3::new(0.0079, 0.0, 0.0), &node, 0.008), [(0, 1.0)]);
    assert!(bind(&Vector3::new(0.0081, 0.0, 0.0), &node, 0.008).is_empty());
}
