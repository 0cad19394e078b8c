//! Which nodes move a point, and by how much (SPEC.md, "Warp").
//!
//! Candidates are the nodes within reach, found by a hash of cells as wide as the reach. The four nearest move the
//! point with weights `1 - d / d_max`, normalised; `d_max` is the distance to the fifth, so a node has no weight when
//! it comes or goes, and it does not matter that two implementations may round a tie differently.

use std::collections::HashMap;

use protocol::NodeTable;

/// Nodes that move a point.
const MOVERS: usize = 4;
/// Slack of `d_max`, so that the sum of the weights is never 0: relative and metres.
const OUTER_FACTOR: f32 = 1.001;
const OUTER_SLACK_M: f32 = 1e-6;

type Cell = [i32; 3];

/// The nodes that move one point; none where it is out of reach of all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    /// Indices of the nodes, nearest first; as many as there are weights above 0 count.
    pub nodes: [usize; MOVERS],
    /// Sum to 1, or all 0.
    pub weights: [f32; MOVERS],
}

/// Finds nodes near points.
#[derive(Clone, Debug)]
pub struct NodeIndex {
    positions_m: Vec<[f32; 3]>,
    reach_m: f32,
    /// By cell, all nodes in it and in the 26 around it, by index (which is by id).
    around: HashMap<Cell, Vec<usize>>,
}

impl NodeIndex {
    /// Over the nodes in their present places. A reach that is no positive number reaches nothing.
    pub fn new(nodes: &NodeTable, reach_m: f32) -> Self {
        let positions_m: Vec<[f32; 3]> = nodes.positions().iter().map(|position| position.unpack()).collect();
        let mut index = Self { positions_m, reach_m, around: HashMap::new() };
        if reach_m > 0.0 {
            for node in 0..index.positions_m.len() {
                let home = index.cell_of(index.positions_m[node]);
                for cell in neighbourhood(home) {
                    index.around.entry(cell).or_default().push(node);
                }
            }
        }
        index
    }

    /// Place of a node, metres.
    pub fn position_m(&self, node: usize) -> [f32; 3] {
        self.positions_m[node]
    }

    fn cell_of(&self, point_m: [f32; 3]) -> Cell {
        point_m.map(|value| (value / self.reach_m).floor() as i32)
    }

    /// The nodes that move `point_m`.
    pub fn bind(&self, point_m: [f32; 3]) -> Binding {
        self.finder().bind(point_m)
    }

    /// Finds the nodes of many points; quick where each is near the one before.
    pub fn finder(&self) -> NodeFinder<'_> {
        NodeFinder { index: self, cell: [i32::MAX; 3], candidates: &[] }
    }

    fn nearest_of(&self, candidates: &[usize], point_m: [f32; 3]) -> Binding {
        let mut nearest = [(self.reach_m * self.reach_m, usize::MAX); MOVERS + 1];
        for &node in candidates {
            let [dx, dy, dz] = difference(self.positions_m[node], point_m);
            let square = dx * dx + dy * dy + dz * dz;
            // Candidates come by increasing id, so the lower id keeps its place at equal distance.
            if square < nearest[MOVERS].0 {
                let mut place = MOVERS;
                while place > 0 && square < nearest[place - 1].0 {
                    nearest[place] = nearest[place - 1];
                    place -= 1;
                }
                nearest[place] = (square, node);
            }
        }
        weigh(&nearest)
    }
}

/// A [`NodeIndex`] that remembers the cell of the last point.
#[derive(Clone, Debug)]
pub struct NodeFinder<'a> {
    index: &'a NodeIndex,
    cell: Cell,
    candidates: &'a [usize],
}

impl NodeFinder<'_> {
    /// The nodes that move `point_m`.
    pub fn bind(&mut self, point_m: [f32; 3]) -> Binding {
        let cell = self.index.cell_of(point_m);
        if cell != self.cell {
            self.cell = cell;
            self.candidates = self.index.around.get(&cell).map_or(&[][..], Vec::as_slice);
        }
        self.index.nearest_of(self.candidates, point_m)
    }
}

fn weigh(nearest: &[(f32, usize); MOVERS + 1]) -> Binding {
    let outer_m = OUTER_FACTOR * nearest[MOVERS].0.sqrt() + OUTER_SLACK_M;
    let mut binding = Binding { nodes: [0; MOVERS], weights: [0.0; MOVERS] };
    for (place, &(square, node)) in nearest[..MOVERS].iter().enumerate() {
        if node != usize::MAX {
            binding.nodes[place] = node;
            binding.weights[place] = 1.0 - square.sqrt() / outer_m;
        }
    }
    let sum: f32 = binding.weights.iter().sum();
    if sum > 0.0 {
        binding.weights = binding.weights.map(|weight| weight / sum);
    }
    binding
}

fn neighbourhood([x, y, z]: Cell) -> impl Iterator<Item = Cell> {
    let axis = |at: i32| [at.saturating_sub(1), at, at.saturating_add(1)];
    axis(x)
        .into_iter()
        .flat_map(move |x| axis(y).into_iter().flat_map(move |y| axis(z).into_iter().map(move |z| [x, y, z])))
}

pub(crate) fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::NodePosition;

    fn nodes(positions_m: &[[f32; 3]]) -> NodeTable {
        let packed = positions_m.iter().map(|&position| NodePosition::pack(position));
        NodeTable::from_sorted((10..).zip(packed).collect())
    }

    fn index(positions_m: &[[f32; 3]]) -> NodeIndex {
        NodeIndex::new(&nodes(positions_m), 0.01)
    }

    #[test]
    fn the_four_nearest_of_five_move_a_point() {
        let index = index(&[
            [0.001, 0.0, 0.0],
            [0.0, 0.002, 0.0],
            [0.0, 0.0, 0.003],
            [0.004, 0.0, 0.0],
            [0.0, 0.005, 0.0],
        ]);
        let binding = index.bind([0.0; 3]);
        assert_eq!(binding.nodes, [0, 1, 2, 3]);
        let expected = [4.0, 3.0, 2.0, 1.0].map(|weight| weight / 10.0);
        for (got, expected) in binding.weights.into_iter().zip(expected) {
            assert!((got - expected).abs() < 1e-3, "{got} {expected}");
        }
    }

    #[test]
    fn a_lone_node_moves_what_it_reaches_and_nothing_else() {
        let index = index(&[[0.0, 0.0, 0.0]]);
        assert_eq!(index.bind([0.009, 0.0, 0.0]).weights, [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(index.bind([0.0101, 0.0, 0.0]).weights, [0.0; 4]);
        assert_eq!(index.bind([f32::NAN; 3]).weights, [0.0; 4]);
    }

    #[test]
    fn at_equal_distance_the_lower_id_comes_first() {
        let index = index(&[
            [0.001, 0.0, 0.0],
            [-0.001, 0.0, 0.0],
            [0.0, 0.001, 0.0],
            [0.0, -0.001, 0.0],
            [0.0, 0.0, 0.001],
        ]);
        assert_eq!(index.bind([0.0; 3]).nodes, [0, 1, 2, 3]);
    }

    #[test]
    fn weights_go_over_smoothly_where_the_fourth_and_the_fifth_swap() {
        let index = index(&[
            [0.0, 0.0, 0.0],
            [0.001, 0.0, 0.0],
            [-0.001, 0.001, 0.0],
            [0.004, 0.0, 0.0],
            [-0.004, 0.0, 0.0],
        ]);
        let weight_of = |x_m: f32| {
            let binding = index.bind([x_m, 0.0, 0.0]);
            let place = binding.nodes.iter().position(|&node| node == 3);
            place.map_or(0.0, |place| binding.weights[place])
        };
        let (before, after) = (weight_of(-1e-6), weight_of(1e-6));
        assert!((before - after).abs() < 2e-3, "{before} {after}");
    }

    #[test]
    fn a_reach_of_nothing_reaches_nothing() {
        for reach_m in [0.0, -1.0, f32::NAN] {
            let index = NodeIndex::new(&nodes(&[[0.0; 3]]), reach_m);
            assert_eq!(index.bind([0.0; 3]).weights, [0.0; 4]);
        }
    }
}
