//! Pose graphs: many poses from measured motions between pairs of them (Grisetti et al. 2010).
//!
//! For poses `T_i` (`camera_from_world`) and measured motions `M_ij` (`j_from_i`), minimises
//! `sum w_ij |D e_ij|^2`, `e_ij = log(M_ij^-1 T_j T_i^-1)`, `D = diag(1/s, 1/s, 1/s, 1, 1, 1)` with `s` the typical depth, so that a
//! translation counts like the rotation that moves the image as much. With left updates `exp(xi) T`,
//! `de/dxi_j = J Ad(M^-1)` and `de/dxi_i = -J Ad(E)`, `E = exp(e)`, `J` the inverse left Jacobian of SE(3) by its series.
//! Levenberg-Marquardt with sparse Cholesky (faer); a step is kept only if it lowers the cost.

use faer::sparse::Triplet;
use geometry::{Pose, se3};
use nalgebra::{Matrix6, UnitQuaternion, Vector6};

use super::cholesky::solve_sparse;

/// Damping: start, factors on success and failure, and where no step can be expected any more.
const DAMPING_START: f64 = 1e-6;
const DAMPING_DOWN: f64 = 0.1;
const DAMPING_UP: f64 = 10.0;
const DAMPING_MAX: f64 = 1e6;
/// Steps with a smaller relative gain end the descent.
const GAIN_MIN: f64 = 1e-6;
/// A cost this small per edge is none: a ten-thousandth of a milliradian.
const COST_MIN: f64 = 1e-14;

/// A pose of the graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraphNode {
    /// The pose.
    pub camera_from_world: Pose,
    /// Whether it is taken as true.
    pub fixed: bool,
}

/// A measured motion between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraphEdge {
    /// Index of the first pose.
    pub from: usize,
    /// Index of the second pose.
    pub to: usize,
    /// The second camera's frame from the first one's.
    pub to_from_from: Pose,
    /// Factor on the information.
    pub weight: f64,
}

/// Poses and the motions between them.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseGraph {
    /// Poses; at least one should be fixed.
    pub nodes: Vec<GraphNode>,
    /// Motions.
    pub edges: Vec<GraphEdge>,
    /// Translation that counts like a rotation by one radian, m.
    pub length_scale_m: f64,
}

impl PoseGraph {
    /// The cost of all edges.
    pub fn cost(&self) -> f64 {
        self.edges.iter().map(|edge| edge.weight * self.residual(edge).norm_squared()).sum()
    }

    /// `D e` of an edge.
    pub fn residual(&self, edge: &GraphEdge) -> Vector6<f64> {
        self.scaled(&se3::log(&self.error(edge)))
    }

    /// Derivatives of an edge's residual with respect to the tangents of its first and second pose.
    pub fn jacobians(&self, edge: &GraphEdge) -> (Matrix6<f64>, Matrix6<f64>) {
        let error = self.error(edge);
        let mut outer = inverse_left_jacobian(&se3::log(&error));
        for row in 0..3 {
            outer.row_mut(row).scale_mut(1.0 / self.length_scale_m);
        }
        (-outer * adjoint(&error), outer * adjoint(&edge.to_from_from.inverse()))
    }

    fn error(&self, edge: &GraphEdge) -> Pose {
        let motion =
            self.nodes[edge.to].camera_from_world * self.nodes[edge.from].camera_from_world.inverse();
        edge.to_from_from.inverse() * motion
    }

    fn scaled(&self, tangent: &Vector6<f64>) -> Vector6<f64> {
        let mut scaled = *tangent;
        scaled.fixed_rows_mut::<3>(0).scale_mut(1.0 / self.length_scale_m);
        scaled
    }

    /// At most `steps_max` steps, none of which raises the cost; gives the cost reached.
    pub fn minimise(&mut self, steps_max: u32) -> f64 {
        let mut cost = self.cost();
        let mut damping = DAMPING_START;
        let mut steps = 0;
        while steps < steps_max && damping <= DAMPING_MAX && cost > COST_MIN * self.edges.len() as f64 {
            let Some(nodes) = self.step(damping) else { break };
            let candidate = Self { nodes, edges: std::mem::take(&mut self.edges), ..*self };
            let candidate_cost = candidate.cost();
            self.edges = candidate.edges;
            if candidate_cost < cost {
                let converged = cost - candidate_cost <= GAIN_MIN * cost;
                (self.nodes, cost) = (candidate.nodes, candidate_cost);
                damping *= DAMPING_DOWN;
                steps += 1;
                if converged {
                    break;
                }
            } else {
                damping *= DAMPING_UP;
            }
        }
        cost
    }

    /// The nodes after one damped step; `None` where the system cannot be solved.
    fn step(&self, damping: f64) -> Option<Vec<GraphNode>> {
        let mut count = 0;
        let places: Vec<Option<usize>> = self
            .nodes
            .iter()
            .map(|node| {
                let place = (!node.fixed).then_some(count);
                count += usize::from(!node.fixed);
                place
            })
            .collect();
        if count == 0 {
            return None;
        }
        let mut system = Sparse { triplets: Vec::new(), right_side: vec![0.0; 6 * count] };
        for edge in &self.edges {
            let residual = self.residual(edge);
            let (by_from, by_to) = self.jacobians(edge);
            let sides = [(places[edge.from], by_from), (places[edge.to], by_to)];
            for (row, row_jacobian) in sides {
                let Some(row) = row else { continue };
                let slope = row_jacobian.tr_mul(&residual) * edge.weight;
                for axis in 0..6 {
                    system.right_side[6 * row + axis] -= slope[axis];
                }
                for (column, column_jacobian) in sides {
                    let Some(column) = column else { continue };
                    let mut block = row_jacobian.tr_mul(&column_jacobian) * edge.weight;
                    if row == column {
                        for axis in 0..6 {
                            block[(axis, axis)] *= 1.0 + damping;
                        }
                    }
                    system.add(row, column, &block);
                }
            }
        }
        let tangents = solve_sparse(&system.triplets, &system.right_side)?;
        let moved = |(node, place): (&GraphNode, &Option<usize>)| match place {
            Some(place) => {
                let tangent = Vector6::from_column_slice(&tangents[6 * place..6 * place + 6]);
                GraphNode { camera_from_world: updated(&node.camera_from_world, &tangent), ..*node }
            }
            None => *node,
        };
        Some(self.nodes.iter().zip(&places).map(moved).collect())
    }
}

struct Sparse {
    triplets: Vec<Triplet<usize, usize, f64>>,
    right_side: Vec<f64>,
}

impl Sparse {
    /// Adds a block's part on and below the diagonal.
    fn add(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
        for j in 0..6 {
            for i in 0..6 {
                let (row, column) = (6 * row + i, 6 * column + j);
                if row >= column {
                    self.triplets.push(Triplet::new(row, column, block[(i, j)]));
                }
            }
        }
    }
}

fn updated(pose: &Pose, tangent: &Vector6<f64>) -> Pose {
    let pose = se3::exp(tangent) * pose;
    Pose::from_parts(pose.translation, UnitQuaternion::new_normalize(pose.rotation.into_inner()))
}

/// `exp(adjoint(T) xi) T = T exp(xi)`, tangents `[rho; phi]`.
fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = *pose.rotation.to_rotation_matrix().matrix();
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    let coupling = se3::skew(&pose.translation.vector) * rotation;
    adjoint.fixed_view_mut::<3, 3>(0, 3).copy_from(&coupling);
    adjoint
}

/// Inverse left Jacobian of SE(3): `sum B_n / n! ad^n` with Bernoulli's numbers, to the sixth order in the tangent.
fn inverse_left_jacobian(tangent: &Vector6<f64>) -> Matrix6<f64> {
    let (rho, phi) = (tangent.fixed_rows::<3>(0).into_owned(), tangent.fixed_rows::<3>(3).into_owned());
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&se3::skew(&phi));
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&se3::skew(&phi));
    ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&se3::skew(&rho));
    let ad2 = ad * ad;
    let ad4 = ad2 * ad2;
    Matrix6::identity() - ad * 0.5 + ad2 / 12.0 - ad4 / 720.0 + ad4 * ad2 / 30240.0
}
