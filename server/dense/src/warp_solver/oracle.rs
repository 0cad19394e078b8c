//! CPU mirror of the energy in double precision: every residual with its derivatives, and the normal equations
//! assembled and solved by faer.

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use nalgebra::{Isometry3, Matrix3, Matrix3x4, Rotation3, Vector3, Vector4};

use super::SolverSettings;

/// Which term of the energy a residual belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Term {
    Rotation,
    Smoothness,
    Data,
    Match,
    Turn,
    Shift,
    Rest,
}

/// A scalar residual of a model point and a plane in the camera.
#[derive(Clone, Debug)]
pub(super) struct PointResidual {
    pub term: Term,
    /// In the world before the warp, m.
    pub point: Vector3<f64>,
    /// Nodes, as indices into [`Problem::nodes`], and their weights.
    pub anchors: Vec<(usize, f64)>,
    pub normal: Vector3<f64>,
    pub offset_mm: f64,
    pub weight: f64,
    pub threshold_mm: f64,
}

/// All that the energy depends on. Nodes that are not solved stay at rest.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    /// Positions, m.
    pub nodes: Vec<Vector3<f64>>,
    /// Number among the solved ones, `None` where a node is not solved.
    pub solved: Vec<Option<usize>>,
    /// Neighbours of each node.
    pub edges: Vec<Vec<usize>>,
    pub points: Vec<PointResidual>,
    pub camera_from_world: Isometry3<f64>,
    pub settings: SolverSettings,
}

/// Node warps `[A | t]` with `t` in mm, and the pose correction.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    pub nodes: Vec<Matrix3x4<f64>>,
    pub turn: Rotation3<f64>,
    pub shift_mm: Vector3<f64>,
}

/// A residual: value, weight of its kernel, threshold, and derivatives by the unknowns.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub term: Term,
    pub value: f64,
    pub weight: f64,
    pub threshold: f64,
    pub derivatives: Vec<(usize, f64)>,
}

impl Row {
    fn squared(term: Term, value: f64, weight: f32, derivatives: Vec<(usize, f64)>) -> Self {
        Self { term, value, weight: f64::from(weight), threshold: f64::INFINITY, derivatives }
    }

    fn energy(&self) -> f64 {
        let size = self.value.abs();
        let linear = self.threshold * (2.0 * size - self.threshold);
        self.weight * if size <= self.threshold { size * size } else { linear }
    }

    /// Weight of the square that has the kernel's slope.
    fn slope(&self) -> f64 {
        self.weight * (self.threshold / self.value.abs().max(1e-300)).min(1.0)
    }
}

impl Estimate {
    pub fn at_rest(nodes: usize) -> Self {
        Self {
            nodes: vec![Matrix3x4::identity(); nodes],
            turn: Rotation3::identity(),
            shift_mm: Vector3::zeros(),
        }
    }

    /// After a step of all unknowns.
    pub fn stepped(&self, problem: &Problem, step: &[f64]) -> Self {
        let mut after = self.clone();
        for (node, number) in problem.solved.iter().enumerate() {
            let Some(first) = number.map(|number| 12 * number) else { continue };
            after.nodes[node] += Matrix3x4::from_fn(|axis, column| step[first + 4 * axis + column]);
        }
        let pose = &step[step.len() - 6..];
        let turn = Rotation3::new(Vector3::new(pose[3], pose[4], pose[5]));
        after.turn = turn * self.turn;
        after.shift_mm = turn * self.shift_mm + Vector3::new(pose[0], pose[1], pose[2]);
        after
    }
}

impl Problem {
    /// Unknowns: 12 per solved node, then shift and turn of the pose.
    pub fn unknowns(&self) -> usize {
        12 * self.solved.iter().flatten().count() + 6
    }

    pub fn energy(&self, estimate: &Estimate) -> f64 {
        self.rows(estimate).iter().map(Row::energy).sum()
    }

    /// Every residual at an estimate.
    pub fn rows(&self, estimate: &Estimate) -> Vec<Row> {
        let mut rows: Vec<Row> = self.points.iter().map(|point| self.point_row(point, estimate)).collect();
        for node in 0..self.nodes.len() {
            if self.solved[node].is_some() {
                rows.extend(self.rotation_rows(node, estimate));
                rows.extend(self.rest_rows(node, estimate));
            }
            for &other in &self.edges[node] {
                if self.solved[node].is_some() || self.solved[other].is_some() {
                    rows.extend(self.edge_rows(node, other, estimate));
                }
            }
        }
        rows.extend(self.pose_rows(estimate));
        rows
    }

    /// Index of an unknown of a node, `None` where it is not solved.
    fn unknown(&self, node: usize, axis: usize, column: usize) -> Option<usize> {
        self.solved[node].map(|number| 12 * number + 4 * axis + column)
    }

    fn point_row(&self, residual: &PointResidual, estimate: &Estimate) -> Row {
        let arm = |node: usize| (1e3 * (residual.point - self.nodes[node])).push(1.0);
        let moved_mm: Vector3<f64> = (residual.anchors.iter())
            .map(|&(node, weight)| weight * (1e3 * self.nodes[node] + estimate.nodes[node] * arm(node)))
            .sum();
        let rotation = self.camera_from_world.rotation;
        let tracked_mm = rotation * moved_mm + 1e3 * self.camera_from_world.translation.vector;
        let in_camera = estimate.turn * tracked_mm + estimate.shift_mm;
        let gradient = rotation.inverse() * (estimate.turn.inverse() * residual.normal);
        let mut derivatives = Vec::new();
        for &(node, weight) in &residual.anchors {
            for (axis, column) in (0..12).map(|i| (i / 4, i % 4)) {
                let slope = weight * gradient[axis] * arm(node)[column];
                derivatives.extend(self.unknown(node, axis, column).map(|unknown| (unknown, slope)));
            }
        }
        if self.settings.hold_pose == 0 {
            let pose = self.unknowns() - 6;
            let by_turn = in_camera.cross(&residual.normal);
            derivatives.extend((0..3).map(|axis| (pose + axis, residual.normal[axis])));
            derivatives.extend((0..3).map(|axis| (pose + 3 + axis, by_turn[axis])));
        }
        Row {
            term: residual.term,
            value: residual.normal.dot(&in_camera) - residual.offset_mm,
            weight: residual.weight,
            threshold: residual.threshold_mm,
            derivatives,
        }
    }

    fn rotation_rows(&self, node: usize, estimate: &Estimate) -> Vec<Row> {
        let a = estimate.nodes[node];
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let row = |(p, q): (usize, usize)| {
            let value = a.column(p).dot(&a.column(q)) - if p == q { 1.0 } else { 0.0 };
            let mut by = Vec::new();
            for axis in 0..3 {
                by.extend(self.unknown(node, axis, p).map(|unknown| (unknown, a[(axis, q)])));
                by.extend(self.unknown(node, axis, q).map(|unknown| (unknown, a[(axis, p)])));
            }
            Row::squared(Term::Rotation, value, self.settings.w_rot, by)
        };
        pairs.into_iter().map(row).collect()
    }

    fn rest_rows(&self, node: usize, estimate: &Estimate) -> Vec<Row> {
        let off = estimate.nodes[node] - Matrix3x4::identity();
        let row = |(axis, column): (usize, usize)| {
            let by = self.unknown(node, axis, column).map(|unknown| (unknown, 1.0)).into_iter().collect();
            let weight = if column == 3 { self.settings.w_rest } else { self.settings.w_rest_turn };
            Row::squared(Term::Rest, off[(axis, column)], weight, by)
        };
        (0..3).flat_map(|axis| (0..4).map(move |column| (axis, column))).map(row).collect()
    }

    fn edge_rows(&self, node: usize, other: usize, estimate: &Estimate) -> Vec<Row> {
        let across: Vector3<f64> = 1e3 * (self.nodes[other] - self.nodes[node]);
        let arm: Vector4<f64> = across.push(1.0);
        let carried = estimate.nodes[node] * arm;
        let row = |axis: usize| {
            let value = carried[axis] - across[axis] - estimate.nodes[other][(axis, 3)];
            let mut by = Vec::new();
            for column in 0..4 {
                by.extend(self.unknown(node, axis, column).map(|unknown| (unknown, arm[column])));
            }
            by.extend(self.unknown(other, axis, 3).map(|unknown| (unknown, -1.0)));
            Row::squared(Term::Smoothness, value, self.settings.w_reg, by)
        };
        (0..3).map(row).collect()
    }

    fn pose_rows(&self, estimate: &Estimate) -> Vec<Row> {
        let pose = self.unknowns() - 6;
        let (turn, shift) = (estimate.turn.scaled_axis(), estimate.shift_mm);
        let cross: Matrix3<f64> = turn.cross_matrix();
        let by_turn = Matrix3::identity() - 0.5 * cross + cross * cross / 12.0;
        let dragged = -shift.cross_matrix();
        let mut rows = Vec::new();
        for axis in 0..3 {
            let by = (0..3).map(|column| (pose + 3 + column, by_turn[(axis, column)])).collect();
            rows.push(Row::squared(Term::Turn, turn[axis], self.settings.w_r, by));
            let mut by: Vec<_> = (0..3).map(|column| (pose + 3 + column, dragged[(axis, column)])).collect();
            by.push((pose + axis, 1.0));
            rows.push(Row::squared(Term::Shift, shift[axis], self.settings.w_p, by));
        }
        rows
    }

    /// What a point adds to the matrix between two solved nodes, as a share of its exact part: nothing where no edge
    /// joins them, and what bounds that to the blocks of both; see `assemble_nodes.wgsl`.
    fn share(&self, point: &PointResidual, a: usize, b: usize) -> f64 {
        let solved =
            || point.anchors.iter().filter_map(|&(node, weight)| Some((node, weight, self.solved[node]?)));
        let find = |number: usize| solved().find(|anchor| anchor.2 == number);
        match (find(a), find(b)) {
            (Some((node, weight, _)), Some(_)) if a == b => {
                let apart = solved().filter(|other| other.0 != node && !self.edges[node].contains(&other.0));
                1.0 + apart.map(|other| other.1).sum::<f64>() / weight
            }
            (Some(first), Some(second)) if !self.edges[first.0].contains(&second.0) => 0.0,
            _ => 1.0,
        }
    }

    /// One step of Levenberg-Marquardt: the damped normal equations, solved by a sparse factorisation.
    pub fn solve(&self, estimate: &Estimate, damping: f64) -> Vec<f64> {
        let unknowns = self.unknowns();
        let mut matrix = std::collections::BTreeMap::<(usize, usize), f64>::new();
        let mut right = Mat::<f64>::zeros(unknowns, 1);
        for (number, row) in self.rows(estimate).iter().enumerate() {
            let slope = row.slope();
            for &(i, by_i) in &row.derivatives {
                right[(i, 0)] -= slope * by_i * row.value;
                for &(j, by_j) in &row.derivatives {
                    let share =
                        self.points.get(number).map_or(1.0, |point| self.share(point, i / 12, j / 12));
                    *matrix.entry((i, j)).or_default() += share * slope * by_i * by_j;
                }
            }
        }
        (0..unknowns).for_each(|i| *matrix.entry((i, i)).or_default() *= 1.0 + damping);
        let entries: Vec<_> = matrix.into_iter().map(|((i, j), value)| Triplet::new(i, j, value)).collect();
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(unknowns, unknowns, &entries).unwrap();
        let solution = matrix.sp_cholesky(Side::Lower).unwrap().solve(&right);
        (0..unknowns).map(|i| solution[(i, 0)]).collect()
    }
}

mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::testing::{Numbers, config};

    /// Five nodes, the last not solved, with two points each of data and matches.
    fn problem(numbers: &mut Numbers) -> Problem {
        let nodes: Vec<_> = (0..5).map(|_| 0.01 * numbers.vector()).collect();
        let mut settings = SolverSettings::new(&config().warp, (64, 48));
        (settings.w_rest, settings.w_rest_turn, settings.w_reg) = (0.3, 7.0, 20.0);
        let point = |numbers: &mut Numbers, term| PointResidual {
            term,
            point: 0.01 * numbers.vector(),
            anchors: vec![(0, 0.4), (2, 0.3), (3, 0.1), (4, 0.2)],
            normal: numbers.vector().normalize(),
            offset_mm: 50.0 * numbers.next(),
            weight: 1.5,
            threshold_mm: 0.7,
        };
        let terms = [Term::Data, Term::Data, Term::Match, Term::Match];
        let points = terms.into_iter().map(|term| point(numbers, term)).collect();
        Problem {
            solved: vec![Some(0), Some(1), Some(2), Some(3), None],
            edges: (0..5).map(|node| (0..5).filter(|&other| other != node).collect()).collect(),
            camera_from_world: Isometry3::new(0.05 * numbers.vector(), numbers.vector()),
            nodes,
            points,
            settings,
        }
    }

    #[test]
    fn the_derivatives_of_all_terms_agree_with_finite_differences() {
        let mut numbers = Numbers::new(41);
        let mut tried: BTreeMap<Term, usize> = BTreeMap::new();
        for _ in 0..5 {
            let problem = problem(&mut numbers);
            let mut random = |scale: f64| -> Vec<f64> {
                (0..problem.unknowns()).map(|_| scale * numbers.next()).collect()
            };
            let estimate = Estimate::at_rest(5).stepped(&problem, &random(0.05));
            let rows = problem.rows(&estimate);
            let step = 1e-5;
            for unknown in 0..problem.unknowns() {
                let at = |side: f64| {
                    let mut by = vec![0.0; problem.unknowns()];
                    by[unknown] = side * step;
                    problem.rows(&estimate.stepped(&problem, &by))
                };
                let (after, before) = (at(1.0), at(-1.0));
                for (number, row) in rows.iter().enumerate() {
                    let numeric = (after[number].value - before[number].value) / (2.0 * step);
                    let own = row.derivatives.iter().filter(|by| by.0 == unknown);
                    let stated: f64 = own.map(|by| by.1).sum();
                    let off = (stated - numeric).abs();
                    assert!(off < 1e-5 * (1.0 + numeric.abs()), "{:?}: {stated} {numeric}", row.term);
                    *tried.entry(row.term).or_default() += usize::from(numeric.abs() > 1e-3);
                }
            }
        }
        assert_eq!(tried.len(), 7);
        assert!(tried.values().all(|&count| count >= 15), "{tried:?}");
    }

    #[test]
    fn a_step_of_the_oracle_lowers_the_energy() {
        let mut numbers = Numbers::new(3);
        let problem = problem(&mut numbers);
        let start = Estimate::at_rest(5);
        let after = start.stepped(&problem, &problem.solve(&start, 1e-3));
        assert!(problem.energy(&after) < problem.energy(&start));
    }
}
