//! CPU mirror of the warp: every surfel by brute force over all nodes.

use std::sync::Arc;

use gpu::{FrameRecorder, Gpu, StageTimer};
use nalgebra::{Matrix3, Vector3};

use super::{NodeWarp, StirredCells, SurfelWarp, WarpParts};
use crate::node_graph::{GraphSettings, NodeFinder, NodeStore, OracleNode, bind};
use crate::store::{Bits, Row, SurfelStore};
use crate::testing::{Numbers, config, gpu};

const SURFELS: usize = 345;
const NODES: usize = 101;

/// A node's warp.
#[derive(Clone, Copy)]
struct Motion {
    a: Matrix3<f64>,
    t: Vector3<f64>,
}

impl Motion {
    fn row(&self, row: usize) -> Row {
        let a = self.a;
        [a[(row, 0)], a[(row, 1)], a[(row, 2)], self.t[row]].map(|x| x as f32)
    }
}

struct Bench {
    gpu: Arc<Gpu>,
    nodes: NodeStore,
    surfels: SurfelStore,
    graph: Vec<OracleNode>,
    motions: Vec<Motion>,
    points: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
}

impl Bench {
    fn new(motion: impl Fn(&mut Numbers) -> Motion) -> Self {
        let gpu = gpu();
        let config = config().nodes;
        let mut numbers = Numbers::new(23);
        let place = |numbers: &mut Numbers| (0.02 * numbers.vector()).map(|x| f64::from(x as f32));
        let graph: Vec<_> =
            (0..NODES).map(|id| OracleNode { point: place(&mut numbers), id: id as u32 }).collect();
        let motions: Vec<Motion> = graph.iter().map(|_| motion(&mut numbers)).collect();
        // one of a hundred is beyond the reach of all nodes
        let far = |slot: usize| if slot % 100 == 99 { 10.0 } else { 1.0 };
        let points: Vec<_> = (0..SURFELS).map(|slot| far(slot) * place(&mut numbers)).collect();
        let normals: Vec<_> = points.iter().map(|_| numbers.vector().normalize()).collect();
        let nodes = NodeStore::new(&gpu, &config).unwrap();
        let surfels = SurfelStore::new(&gpu, 512).unwrap();
        let bench = Self { gpu, nodes, surfels, graph, motions, points, normals };
        bench.upload(GraphSettings { surfels: SURFELS as u32, ..GraphSettings::new(&config) });
        bench
    }

    fn upload(&self, settings: GraphSettings) {
        let timer = StageTimer::new(&self.gpu, 1).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, &timer);
        self.nodes.clear(&mut frame);
        frame.submit().collect().unwrap();
        let bits = |node: &OracleNode| {
            let [x, y, z] = [0, 1, 2].map(|axis| (node.point[axis] as f32).to_bits());
            [x, y, z, node.id + 1]
        };
        let rows: Vec<Bits> = self.graph.iter().map(bits).collect();
        let transforms: Vec<Row> =
            self.motions.iter().flat_map(|motion| [0, 1, 2].map(|row| motion.row(row))).collect();
        let row = |v: &Vector3<f64>, w: f64| [v.x, v.y, v.z, w].map(|x| x as f32);
        let geometry: Vec<Row> = self.points.iter().map(|point| row(point, 4e-4)).collect();
        let orientation: Vec<Row> = self.normals.iter().map(|normal| row(normal, 3.0)).collect();
        self.gpu.write(&self.nodes.settings, 0, &[settings]).unwrap();
        self.gpu.write(&self.nodes.rows, 0, &rows).unwrap();
        self.gpu.write(&self.nodes.transforms, 0, &transforms).unwrap();
        self.gpu.write(&self.nodes.travelled, 0, &transforms).unwrap();
        self.gpu.write(&self.surfels.geometry, 0, &geometry).unwrap();
        self.gpu.write(&self.surfels.orientation, 0, &orientation).unwrap();
        self.gpu.write(&self.surfels.history, 0, &vec![[0u32, 0, 0, 1]; SURFELS]).unwrap();
    }

    /// Moves surfels, then nodes.
    fn run(&self) {
        let NodeStore { settings, rows, hash, transforms, travelled, .. } = &self.nodes;
        let SurfelStore { geometry, orientation, history, .. } = &self.surfels;
        let parts = WarpParts { settings, rows, hash, transforms, geometry, orientation, state: history };
        let finder = NodeFinder::new(&self.gpu, settings, rows, hash).unwrap();
        let stirred = StirredCells::new(&self.gpu, &parts).unwrap();
        let surfels = SurfelWarp::new(&self.gpu, &parts, &stirred).unwrap();
        let nodes = NodeWarp::new(&self.gpu, rows, transforms, travelled).unwrap();
        let timer = StageTimer::new(&self.gpu, 4).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, &timer);
        finder.record(&mut frame).unwrap();
        stirred.record(&mut frame).unwrap();
        surfels.record(&mut frame, SURFELS as u32).unwrap();
        nodes.record(&mut frame).unwrap();
        frame.submit().collect().unwrap();
    }

    /// Where the oracle takes surfel `slot`, with its normal.
    fn expected(&self, slot: usize) -> (Vector3<f64>, Vector3<f64>) {
        let reach_m = 2e-3 * config().nodes.spacing_mm;
        let (point, normal) = (self.points[slot], self.normals[slot]);
        let near = bind(&point, &self.graph, reach_m);
        if near.is_empty() {
            return (point, normal);
        }
        let carried = |(node, weight): &(usize, f64)| {
            let (center, motion) = (self.graph[*node].point, self.motions[*node]);
            *weight * (motion.a * (point - center) + center + motion.t)
        };
        let turned = |(node, weight): &(usize, f64)| {
            let inverse = self.motions[*node].a.try_inverse().unwrap();
            *weight * (inverse.transpose() * normal)
        };
        (near.iter().map(carried).sum(), near.iter().map(turned).sum::<Vector3<f64>>().normalize())
    }

    fn rows(&self) -> (Vec<Row>, Vec<Row>) {
        let read = |rows| self.gpu.read_range(rows, 0, SURFELS).unwrap();
        (read(&self.surfels.geometry), read(&self.surfels.orientation))
    }
}

fn vector(row: &Row) -> Vector3<f64> {
    Vector3::new(row[0], row[1], row[2]).map(f64::from)
}

#[test]
fn the_warp_agrees_with_its_oracle() {
    let bench = Bench::new(|numbers| Motion {
        a: Matrix3::identity() + 0.2 * Matrix3::from_fn(|_, _| numbers.next()),
        t: 0.003 * numbers.vector(),
    });
    bench.run();
    let (geometry, orientation) = bench.rows();
    for slot in 0..SURFELS {
        let (point, normal) = bench.expected(slot);
        let off_m = (vector(&geometry[slot]) - point).norm();
        assert!(off_m < 1e-7, "{off_m} m at slot {slot}");
        assert!((vector(&orientation[slot]) - normal).norm() < 1e-5);
        assert_eq!((geometry[slot][3], orientation[slot][3]), (4e-4, 3.0), "radius and weight stay");
    }
    let rows = bench.gpu.read_range(&bench.nodes.rows, 0, NODES).unwrap();
    for (node, motion) in bench.graph.iter().zip(&bench.motions) {
        let moved = Vector3::from_fn(|axis, _| f64::from(f32::from_bits(rows[node.id as usize][axis])));
        assert!((moved - node.point - motion.t).norm() < 1e-8);
    }
    let travelled = bench.gpu.read_range(&bench.nodes.travelled, 0, 3 * NODES).unwrap();
    for (node, motion) in bench.motions.iter().enumerate() {
        let twice = Motion { a: motion.a * motion.a, t: 2.0 * motion.t };
        for row in 0..3 {
            let (found, expected) = (travelled[3 * node + row], twice.row(row));
            assert!((0..4).all(|i| (found[i] - expected[i]).abs() < 1e-6), "{found:?} {expected:?}");
        }
    }
}

#[test]
fn a_warp_at_rest_moves_no_bit() {
    let bench = Bench::new(|_| Motion { a: Matrix3::identity(), t: Vector3::zeros() });
    let before = bench.rows();
    bench.run();
    assert_eq!(bench.rows(), before);
}

#[test]
fn a_warp_that_is_no_number_leaves_surfels_alone() {
    let bench = Bench::new(|_| Motion { a: Matrix3::zeros(), t: Vector3::new(f64::NAN, f64::INFINITY, 0.0) });
    let before = bench.rows();
    bench.run();
    assert_eq!(bench.rows(), before);
}
