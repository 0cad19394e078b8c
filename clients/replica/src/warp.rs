//! The motion of surfels over one epoch (SPEC.md, "Warp").
//!
//! `v' = sum w_j (A_j (v - g_j) + g_j + t_j)` and `n' = sum w_j A_j^-T n`, normalised (paper: Eq.
//! `TransformationFomulation`, the bracket). What would not be finite stays where it is.

use protocol::{NodeTable, NodeTransform};

use crate::Surfel;
use crate::binding::{NodeFinder, NodeIndex, difference};

type Matrix = [[f32; 3]; 3];

/// What one node does to a point near it.
#[derive(Clone, Copy, Debug)]
struct NodeMotion {
    affine: Matrix,
    /// `A^-T`.
    normals: Matrix,
    translation_m: [f32; 3],
    moves: bool,
}

/// The warp of one epoch.
#[derive(Clone, Debug)]
pub struct Warp {
    index: NodeIndex,
    motions: Vec<NodeMotion>,
}

impl Warp {
    /// `transforms` of `nodes` in the places that they have before the epoch, in the same order.
    pub fn new(nodes: &NodeTable, reach_m: f32, transforms: &[NodeTransform]) -> Self {
        Self {
            index: NodeIndex::new(nodes, reach_m),
            motions: transforms.iter().map(NodeMotion::new).collect(),
        }
    }

    /// Moves all surfels.
    pub fn apply(&self, surfels: &mut [Surfel]) {
        let mut finder = self.index.finder();
        surfels.iter_mut().for_each(|surfel| self.carry(&mut finder, surfel));
    }

    fn carry(&self, finder: &mut NodeFinder, surfel: &mut Surfel) {
        let binding = finder.bind(surfel.position_in_world_m);
        let movers = || binding.nodes.into_iter().zip(binding.weights).filter(|(_, weight)| *weight > 0.0);
        if !movers().any(|(node, _)| self.motions[node].moves) {
            return;
        }
        let (mut moved, mut turned) = ([0.0_f32; 3], [0.0_f32; 3]);
        for (node, weight) in movers() {
            let motion = &self.motions[node];
            let place_m = self.index.position_m(node);
            let arm = rotated(&motion.affine, difference(surfel.position_in_world_m, place_m));
            let normal = rotated(&motion.normals, surfel.normal_in_world);
            for axis in 0..3 {
                moved[axis] += weight * (place_m[axis] + (arm[axis] + motion.translation_m[axis]));
                turned[axis] += weight * normal[axis];
            }
        }
        let length = turned.iter().map(|value| value * value).sum::<f32>().sqrt();
        let normal = turned.map(|value| value / length);
        if moved.iter().chain(&normal).all(|value| value.is_finite()) {
            surfel.position_in_world_m = moved;
            surfel.normal_in_world = normal;
        }
    }
}

impl NodeMotion {
    fn new(transform: &NodeTransform) -> Self {
        let affine = transform.affine();
        let [a, b, c] = affine;
        let determinant = dot(a, cross(b, c));
        let normals = [cross(b, c), cross(c, a), cross(a, b)].map(|row| row.map(|value| value / determinant));
        let moves = *transform != NodeTransform::default();
        Self { affine, normals, translation_m: transform.translation_m(), moves }
    }
}

fn rotated(matrix: &Matrix, vector: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| dot(row, vector))
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
