//! Pose graphs against synthetic truth.

use geometry::{Pose, se3};
use nalgebra::Vector6;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use tracking::optimize::pose_graph::{GraphEdge, GraphNode, PoseGraph};

fn tangent(random: &mut Pcg64Mcg, size: f64) -> Vector6<f64> {
    Vector6::from_fn(|_, _| size * random.random_range(-1.0..1.0))
}

/// A closed ring of cameras with measured motions between neighbours, each off by `noise`; the last edge closes the ring.
/// The graph's nodes are the truth.
fn ring(count: usize, noise: f64) -> PoseGraph {
    let mut random = Pcg64Mcg::new(4);
    let turn = 2.0 * std::f64::consts::PI / count as f64;
    let nodes: Vec<GraphNode> = (0..count)
        .map(|index| {
            let angle = turn * index as f64;
            let position = Vector6::new(0.03 * angle.cos(), 0.03 * angle.sin(), 0.0, 0.0, 0.1, angle);
            GraphNode { camera_from_world: se3::exp(&position), fixed: index == 0 }
        })
        .collect();
    let edges = (0..count)
        .map(|from| {
            let to = (from + 1) % count;
            let motion = nodes[to].camera_from_world * nodes[from].camera_from_world.inverse();
            let to_from_from = se3::exp(&tangent(&mut random, noise)) * motion;
            GraphEdge { from, to, to_from_from, weight: random.random_range(0.5..2.0) }
        })
        .collect();
    PoseGraph { nodes, edges, length_scale_m: 0.08 }
}

/// Each pose from the one before it, as a tracker drifts.
fn chained(graph: &PoseGraph) -> PoseGraph {
    let mut chained = graph.clone();
    for edge in &graph.edges[..graph.edges.len() - 1] {
        chained.nodes[edge.to].camera_from_world =
            edge.to_from_from * chained.nodes[edge.from].camera_from_world;
    }
    chained
}

fn worst_position_m(a: &PoseGraph, b: &PoseGraph) -> f64 {
    let centre = |pose: &Pose| pose.inverse().translation.vector;
    let distances = a
        .nodes
        .iter()
        .zip(&b.nodes)
        .map(|(a, b)| (centre(&a.camera_from_world) - centre(&b.camera_from_world)).norm());
    distances.fold(0.0, f64::max)
}

#[test]
fn jacobians_agree_with_finite_differences() {
    let mut graph = ring(7, 0.0);
    let mut random = Pcg64Mcg::new(8);
    for node in &mut graph.nodes {
        node.camera_from_world = se3::exp(&tangent(&mut random, 0.1)) * node.camera_from_world;
    }
    let step = 1e-6;
    for edge in graph.edges.clone() {
        let (by_from, by_to) = graph.jacobians(&edge);
        for (node, jacobian) in [(edge.from, by_from), (edge.to, by_to)] {
            for axis in 0..6 {
                let moved = |size: f64| {
                    let mut moved = graph.clone();
                    let mut tangent = Vector6::zeros();
                    tangent[axis] = size;
                    let pose = &mut moved.nodes[node].camera_from_world;
                    *pose = se3::exp(&tangent) * *pose;
                    moved.residual(&edge)
                };
                let numeric = (moved(step) - moved(-step)) / (2.0 * step);
                let error = (numeric - jacobian.column(axis)).norm();
                assert!(error < 1e-6 * (1.0 + numeric.norm()), "axis {axis}: {error}");
            }
        }
    }
}

#[test]
fn a_ring_that_drifted_is_closed() {
    let truth = ring(40, 1e-3);
    let drifted = chained(&truth);
    let mut closed = drifted.clone();
    let (before, after) = (closed.cost(), closed.minimise(20));
    assert!(after < 0.1 * before, "cost {after} after {before}");
    let (error, drift) = (worst_position_m(&closed, &truth), worst_position_m(&drifted, &truth));
    assert!(error < 0.6 * drift, "{error} m after {drift} m");
    assert_eq!(closed.nodes[0], truth.nodes[0]);
}

#[test]
fn exact_motions_are_met_exactly_from_a_disturbed_start() {
    let truth = ring(25, 0.0);
    let mut graph = truth.clone();
    let mut random = Pcg64Mcg::new(5);
    for node in graph.nodes.iter_mut().skip(1) {
        node.camera_from_world = se3::exp(&tangent(&mut random, 0.02)) * node.camera_from_world;
    }
    graph.minimise(30);
    assert!(worst_position_m(&graph, &truth) < 1e-7, "{}", worst_position_m(&graph, &truth));
}

#[test]
fn the_cost_never_rises() {
    let mut graph = chained(&ring(30, 0.05));
    let mut last = graph.cost();
    for _ in 0..8 {
        let cost = graph.minimise(1);
        assert!(cost <= last && cost.to_bits() == graph.cost().to_bits());
        last = cost;
    }
}

#[test]
fn a_graph_of_fixed_poses_stays() {
    let mut graph = chained(&ring(5, 0.05));
    for node in &mut graph.nodes {
        node.fixed = true;
    }
    let before = graph.clone();
    graph.minimise(5);
    assert_eq!(graph, before);
}
