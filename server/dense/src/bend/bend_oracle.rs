//! CPU mirror of the bend: dates by brute force over all nodes, corrections as rigid motions.

use geometry::Pose;
use gpu::{FrameRecorder, StageTimer};
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::{Bend, Corrections, FrameCorrection, thinned};
use crate::node_graph::{GraphSettings, NodeFinder, NodeStore, OracleNode, bind};
use crate::store::{ALIVE, Bits, Row, SurfelStore};
use crate::testing::{Numbers, config, gpu};

const SURFELS: usize = 345;
const NODES: usize = 101;
/// Behind these nothing is: the last nodes have no surfel.
const LONELY: usize = 7;
const NEAREST: usize = 8;

fn correction(frame: u32, numbers: &mut Numbers) -> FrameCorrection {
    let turn = UnitQuaternion::from_scaled_axis(0.1 * numbers.vector());
    let after_from_before = Pose::from_parts((0.01 * numbers.vector()).into(), turn);
    FrameCorrection { frame, after_from_before }
}

struct Bench {
    graph: Vec<OracleNode>,
    points: Vec<Vector3<f64>>,
    seen: Vec<u32>,
    corrections: Vec<FrameCorrection>,
}

impl Bench {
    fn new(frames: &[u32]) -> Self {
        let mut numbers = Numbers::new(31);
        let place = |numbers: &mut Numbers| (0.02 * numbers.vector()).map(|x| f64::from(x as f32));
        let far = Vector3::new(5.0, 5.0, 5.0);
        let node = |id: usize, numbers: &mut Numbers| OracleNode {
            point: if id + LONELY < NODES { place(numbers) } else { far + place(numbers) },
            id: id as u32,
        };
        Self {
            graph: (0..NODES).map(|id| node(id, &mut numbers)).collect(),
            points: (0..SURFELS).map(|_| place(&mut numbers)).collect(),
            seen: (0..SURFELS).map(|slot| (slot as u32 * 13) % 90).collect(),
            corrections: frames.iter().map(|&frame| correction(frame, &mut numbers)).collect(),
        }
    }

    /// Neighbours that the kernel is told of.
    fn nearest(node: usize) -> impl Iterator<Item = usize> {
        (1..=NEAREST).map(move |step| (node + 11 * step) % NODES)
    }

    /// The transforms that the GPU finds. Every 10th slot is dead, every 17th has no place.
    fn run(&self) -> Vec<Row> {
        let (gpu, config) = (gpu(), config().nodes);
        let nodes = NodeStore::new(&gpu, &config).unwrap();
        let surfels = SurfelStore::new(&gpu, 512).unwrap();
        let timer = StageTimer::new(&gpu, 3).unwrap();
        let mut frame = FrameRecorder::begin(&gpu, &timer);
        nodes.clear(&mut frame);
        frame.submit().collect().unwrap();
        let rows: Vec<Bits> = (self.graph.iter())
            .map(|node| {
                let [x, y, z] = [0, 1, 2].map(|axis| (node.point[axis] as f32).to_bits());
                [x, y, z, node.id + 1]
            })
            .collect();
        let nearest: Vec<u32> =
            (0..NODES).flat_map(|node| Self::nearest(node).map(|slot| slot as u32)).collect();
        let geometry: Vec<Row> = (self.points.iter().enumerate())
            .map(|(slot, p)| {
                [if slot % 17 == 16 { f32::NAN } else { p.x as f32 }, p.y as f32, p.z as f32, 4e-4]
            })
            .collect();
        let history: Vec<Bits> = (self.seen.iter().enumerate())
            .map(|(slot, &seen)| [slot as u32, seen, 0, if slot % 10 == 9 { 0 } else { ALIVE }])
            .collect();
        let settings = GraphSettings { surfels: SURFELS as u32, ..GraphSettings::new(&config) };
        gpu.write(&nodes.settings, 0, &[settings]).unwrap();
        gpu.write(&nodes.rows, 0, &rows).unwrap();
        gpu.write(&nodes.nearest, 0, &nearest).unwrap();
        gpu.write(&surfels.geometry, 0, &geometry).unwrap();
        gpu.write(&surfels.history, 0, &history).unwrap();
        let corrections = Corrections::new(&gpu).unwrap();
        corrections.write(&gpu, &self.corrections).unwrap();
        let finder = NodeFinder::new(&gpu, &nodes.settings, &nodes.rows, &nodes.hash).unwrap();
        let bend = Bend::new(&gpu, &nodes, &surfels, &corrections).unwrap();
        let mut frame = FrameRecorder::begin(&gpu, &timer);
        finder.record(&mut frame).unwrap();
        bend.record(&mut frame, SURFELS as u32).unwrap();
        frame.submit().collect().unwrap();
        gpu.read_range(&nodes.transforms, 0, 3 * NODES).unwrap()
    }

    fn dates(&self) -> Vec<Option<u32>> {
        let mut dates = vec![None; NODES];
        let reach_m = 2e-3 * config().nodes.spacing_mm;
        for (slot, point) in
            self.points.iter().enumerate().filter(|(slot, _)| slot % 10 != 9 && slot % 17 != 16)
        {
            if let Some(&(node, _)) = bind(point, &self.graph, reach_m).first() {
                dates[node] = dates[node].max(Some(self.seen[slot]));
            }
        }
        dates
    }

    /// Rotation and way of a node that was last seen in a frame.
    fn expected(&self, node: usize, frame: u32) -> (Matrix3<f64>, Vector3<f64>) {
        let after = self.corrections.iter().position(|correction| correction.frame > frame);
        let last = self.corrections.len() - 1;
        let (first, second) = match after {
            Some(0) => (0, 0),
            Some(after) => (after - 1, after),
            None => (last, last),
        };
        let (a, b) = (&self.corrections[first], &self.corrections[second]);
        let share =
            if first == second { 0.0 } else { f64::from(frame - a.frame) / f64::from(b.frame - a.frame) };
        let point = Point3::from(self.graph[node].point);
        let moved = |correction: &FrameCorrection| correction.after_from_before * point - point;
        let turn = a.after_from_before.rotation.nlerp(&b.after_from_before.rotation, share);
        (turn.to_rotation_matrix().into_inner(), moved(a).lerp(&moved(b), share))
    }
}

fn check(frames: &[u32]) {
    let bench = Bench::new(frames);
    let (rows, dates) = (bench.run(), bench.dates());
    assert!(
        dates.iter().flatten().count() > 50 && dates.iter().filter(|date| date.is_none()).count() >= LONELY
    );
    for node in 0..NODES {
        let of_others = || Bench::nearest(node).filter_map(|other| dates[other]).max();
        let (turn, way) = bench.expected(node, dates[node].or_else(of_others).unwrap_or(0));
        for axis in 0..3 {
            let row = rows[3 * node + axis].map(f64::from);
            let off = (0..3).map(|column| (row[column] - turn[(axis, column)]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6 && (row[3] - way[axis]).abs() < 2e-6, "node {node}: {row:?}, {turn} {way}");
        }
    }
}

#[test]
fn each_node_goes_with_the_world_of_the_frame_it_was_last_seen_in() {
    check(&[0, 10, 11, 40, 70]);
    check(&[30]);
    check(&[45, 300]);
}

#[test]
fn a_correction_of_nothing_is_the_identity_in_every_bit() {
    let mut bench = Bench::new(&[0, 40]);
    bench.corrections.iter_mut().for_each(|correction| correction.after_from_before = Pose::identity());
    let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    assert!(bench.run().chunks(3).all(|rows| rows == identity));
}

#[test]
fn of_too_many_corrections_the_last_is_kept() {
    let mut numbers = Numbers::new(3);
    let many: Vec<_> = (0..10).map(|frame| correction(frame, &mut numbers)).collect();
    let frames = |most| thinned(&many, most).iter().map(|kept| kept.frame).collect::<Vec<_>>();
    assert_eq!(frames(10), (0..10).collect::<Vec<_>>());
    assert_eq!(frames(4), [0, 3, 6, 9]);
    assert_eq!(frames(3), [1, 5, 9]);
}
