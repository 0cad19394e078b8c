//! CPU mirror of `encode_warp.wgsl` and `follow_nodes.wgsl`, and the bound that publishing keeps.

use nalgebra::{Matrix3, Vector3};

use super::{EncodingSteps, TransformCodes};
use crate::synthetic::{MovedNode, SyntheticModel};
use crate::testing::{Numbers, config, gpu};
use crate::{DenseConfig, Surfel};

const STEPS: EncodingSteps =
    EncodingSteps { position_m: 2e-5, position_max_m: 20.0, node_m: 4e-6, affine: 1.0 / 4096.0 };
const SURFELS: u32 = 345;
const NODES: usize = 101;

fn surfels(numbers: &mut Numbers) -> Vec<Surfel> {
    let surfel = |id| Surfel {
        id,
        position: (0.02 * numbers.vector()).map(|x| x as f32).into(),
        normal: [0.0, 0.6, -0.8],
        radius_m: 4e-4,
        weight: 10.0,
        color: [200, 90, 70],
        stamp: 0,
    };
    (0..SURFELS).map(surfel).collect()
}

fn nodes(numbers: &mut Numbers) -> Vec<MovedNode> {
    let node = |_| MovedNode {
        position: (0.02 * numbers.vector()).map(|x| x as f32).into(),
        affine: Matrix3::<f32>::identity().into(),
    };
    (0..NODES).map(node).collect()
}

/// Moves every node a little; its surroundings turn and stretch.
fn move_nodes(nodes: &mut [MovedNode], numbers: &mut Numbers) {
    for node in nodes {
        let moved: Vector3<f64> = Vector3::from(node.position).cast() + 3e-4 * numbers.vector();
        node.position = moved.map(|x| x as f32).into();
        node.affine = [0, 1, 2].map(|row| {
            let mut unit = 0.02 * numbers.vector();
            unit[row] += 1.0;
            unit.map(|x| x as f32).into()
        });
    }
}

fn place(position: [f32; 3]) -> [i32; 3] {
    position.map(|x| (x / STEPS.node_m as f32).round_ties_even() as i32)
}

fn expected_codes(held: [i32; 3], node: &MovedNode) -> TransformCodes {
    let t = [0, 1, 2].map(|axis| {
        let moved = node.position[axis] - held[axis] as f32 * STEPS.node_m as f32;
        (moved / STEPS.node_m as f32).round_ties_even() as i16
    });
    let mut codes = [0; 12];
    codes[..3].copy_from_slice(&t);
    for (row, values) in node.affine.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            let offset = value - if row == column { 1.0 } else { 0.0 };
            codes[3 + 3 * row + column] = (offset / STEPS.affine as f32).round_ties_even() as i16;
        }
    }
    codes
}

fn model(config: &DenseConfig) -> SyntheticModel {
    SyntheticModel::new(gpu(), config, SURFELS).unwrap()
}

#[test]
fn nodes_come_move_in_whole_steps_and_go() {
    let mut numbers = Numbers::new(5);
    let (surfels, mut nodes) = (surfels(&mut numbers), nodes(&mut numbers));
    let mut model = model(&config());
    model.set(&surfels, &nodes).unwrap();
    let first = model.take_changes(&STEPS).unwrap();
    let mut held: Vec<[i32; 3]> = nodes.iter().map(|node| place(node.position)).collect();
    let expected: Vec<_> = (0..).zip(held.iter().copied()).collect();
    assert_eq!(first.warp.added, expected);
    assert!(first.warp.transforms.is_empty() && first.warp.removed.is_empty());

    for _ in 0..3 {
        move_nodes(&mut nodes, &mut numbers);
        model.set(&surfels, &nodes).unwrap();
        let warp = model.take_changes(&STEPS).unwrap().warp;
        assert_eq!(warp.transforms.len(), NODES);
        for ((held, node), codes) in held.iter_mut().zip(&nodes).zip(&warp.transforms) {
            let expected = expected_codes(*held, node);
            let off = codes.iter().zip(expected).map(|(a, b)| (a - b).abs()).max();
            assert!(off <= Some(1), "{codes:?} {expected:?}");
            held.iter_mut().zip(codes).for_each(|(place, code)| *place += i32::from(*code));
            // Rounding does not add up: what is held is never further off than half a step.
            let off = held.iter().zip(place(node.position)).map(|(a, b)| (a - b).abs()).max();
            assert!(off <= Some(1), "{held:?} {node:?}");
        }
    }
    nodes.iter_mut().for_each(|node| node.affine = Matrix3::identity().into());
    model.set(&surfels, &nodes).unwrap();
    let still = model.take_changes(&STEPS).unwrap();
    assert!(still.warp.transforms.is_empty(), "what does not move is not told");
}

#[test]
fn hostile_nodes_neither_spread_nor_crash() {
    let mut numbers = Numbers::new(6);
    let (surfels, mut nodes) = (surfels(&mut numbers), nodes(&mut numbers));
    let mut model = model(&config());
    model.set(&surfels, &nodes).unwrap();
    model.take_changes(&STEPS).unwrap();
    nodes[3].position[1] = f32::NAN;
    nodes[4].position[0] = f32::INFINITY;
    nodes[5].position[2] += 5.0;
    nodes[6].affine[1][1] = f32::NAN;
    nodes[7].affine[0][0] = 1e30;
    model.set(&surfels, &nodes).unwrap();
    let changes = model.take_changes(&STEPS).unwrap();
    assert_eq!(changes.warp.transforms[3], TransformCodes::default());
    assert_eq!(changes.warp.transforms[5][2], i16::MAX, "as far as a code goes");
    assert!(changes.max_error_m <= 2e-4);
    for held in model.held_surfels().unwrap() {
        assert!(held.position.iter().chain(&held.normal).all(|value| value.is_finite()), "{held:?}");
    }
}

#[test]
fn what_viewers_hold_is_never_further_from_the_model_than_the_bound() {
    let bound_m = 1e-3 * config().publish.position_mm;
    let mut numbers = Numbers::new(7);
    let (mut surfels, mut nodes) = (surfels(&mut numbers), nodes(&mut numbers));
    let mut model = model(&config());
    let mut kept = 0;
    for step in 0..12 {
        model.set(&surfels, &nodes).unwrap();
        let changes = model.take_changes(&STEPS).unwrap();
        let held = model.held_surfels().unwrap();
        assert_eq!(held.len(), surfels.len());
        let worst = held
            .iter()
            .zip(&surfels)
            .map(|(held, surfel)| (Vector3::from(held.position) - Vector3::from(surfel.position)).norm());
        let worst = worst.fold(0.0, f32::max);
        assert!(f64::from(worst) <= bound_m, "{worst} m at step {step}");
        // What was just sent is on the grid, and off by its rounding only.
        assert!(changes.max_error_m <= worst + 1e-9 && worst <= changes.max_error_m.max(1.8e-5));
        kept += surfels.len() - changes.updated.len() - changes.added.len();
        move_nodes(&mut nodes, &mut numbers);
        let drift = 1e-4 * numbers.vector();
        for surfel in &mut surfels {
            let moved: Vector3<f64> = Vector3::from(surfel.position).cast() + drift + 2e-5 * numbers.vector();
            surfel.position = moved.map(|x| x as f32).into();
        }
    }
    assert!(kept > 0, "not everything is sent anew each time");
}
