//! Growth and removal over frames.

use std::sync::Arc;

use gpu::{FrameRecorder, Gpu, StageTimer};
use nalgebra::Vector3;

use super::{ALIVE_NODES, GraphSettings, NodeConfig, NodeGraph, NodeStore};
use crate::store::{ALIVE, Bits, Row, SurfelStore};
use crate::testing::{Numbers, config, gpu};

const SURFELS: usize = 3001;
/// Frames after which a node that no surfel holds is removed, as in `place_nodes.wgsl`.
const HELD_TICKS: u32 = 64;
/// Place of the refused nodes in the state.
const REFUSED_NODES: usize = 2;

struct Patch {
    gpu: Arc<Gpu>,
    nodes: NodeStore,
    graph: NodeGraph,
    surfels: SurfelStore,
    points: Vec<Row>,
    settings: GraphSettings,
}

impl Patch {
    /// A wavy sheet of 60 x 60 mm, some of its surfels no numbers.
    fn new(config: &NodeConfig) -> Self {
        let gpu = gpu();
        let surfels = SurfelStore::new(&gpu, 4096).unwrap();
        let nodes = NodeStore::new(&gpu, config).unwrap();
        let mut numbers = Numbers::new(17);
        let mut points: Vec<Row> = (0..SURFELS)
            .map(|_| {
                let at = 0.03 * numbers.vector();
                [at.x, at.y, 0.003 * (200.0 * at.x).sin(), 0.0].map(|x| x as f32)
            })
            .collect();
        (0..SURFELS)
            .step_by(97)
            .for_each(|slot| points[slot][slot % 3] = [f32::NAN, f32::INFINITY][slot % 2]);
        gpu.write(&surfels.geometry, 0, &points).unwrap();
        let graph = NodeGraph::new(&gpu, &nodes, &surfels).unwrap();
        let mut settings = GraphSettings::new(config);
        settings.surfels = SURFELS as u32;
        let patch = Self { gpu, nodes, graph, surfels, points, settings };
        patch.record(|frame| patch.nodes.clear(frame));
        patch
    }

    fn record(&self, what: impl FnOnce(&mut FrameRecorder)) {
        let timer = StageTimer::new(&self.gpu, 8).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, &timer);
        what(&mut frame);
        frame.submit().collect().unwrap();
    }

    /// One frame in which the surfels that `seen` says are seen, and all of `alive` are alive.
    fn tick(&mut self, seen: bool, alive: impl Fn(usize) -> bool) {
        self.settings.tick += 1;
        self.settings.frame = 3 * self.settings.tick;
        let stamp = if seen { self.settings.frame } else { 0 };
        let history: Vec<Bits> =
            (0..SURFELS).map(|slot| [slot as u32, stamp, 0, if alive(slot) { ALIVE } else { 0 }]).collect();
        self.gpu.write(&self.surfels.history, 0, &history).unwrap();
        self.gpu.write(&self.nodes.settings, 0, &[self.settings]).unwrap();
        self.record(|frame| self.graph.record(frame, SURFELS as u32).unwrap());
    }

    /// Positions and ids of the nodes.
    fn nodes(&self) -> Vec<(Vector3<f32>, u32)> {
        let rows = self.gpu.read(&self.nodes.rows).unwrap();
        let node = |row: &Bits| (Vector3::new(row[0], row[1], row[2]).map(f32::from_bits), row[3] - 1);
        rows.iter().filter(|row| row[3] != 0).map(node).collect()
    }

    fn points(&self) -> impl Iterator<Item = Vector3<f32>> {
        let finite = self.points.iter().filter(|point| point.iter().all(|x| x.is_finite()));
        finite.map(|point| Vector3::new(point[0], point[1], point[2]))
    }
}

fn nearest_m(point: &Vector3<f32>, nodes: &[(Vector3<f32>, u32)]) -> f32 {
    nodes.iter().map(|(node, _)| (node - point).norm()).fold(f32::INFINITY, f32::min)
}

#[test]
fn nodes_cover_what_is_seen_at_their_spacing_and_no_closer() {
    let mut patch = Patch::new(&config().nodes);
    (0..20).for_each(|_| patch.tick(true, |_| true));
    let nodes = patch.nodes();
    let spacing_m = patch.settings.spacing_m;
    let covered = patch.points().filter(|point| nearest_m(point, &nodes) <= spacing_m).count();
    assert_eq!(covered, patch.points().count());
    for (number, (node, id)) in nodes.iter().enumerate() {
        assert!(nearest_m(node, &nodes[..number]) > 0.69 * spacing_m);
        assert!(nodes[..number].iter().all(|(_, other)| other != id));
    }
    let per_cell = nodes.len() as f32 * (spacing_m / 0.06).powi(2);
    assert!((0.6..1.3).contains(&per_cell), "{per_cell} nodes per cell");
    assert_eq!(patch.gpu.read(&patch.nodes.state).unwrap()[ALIVE_NODES], nodes.len() as u32);
}

#[test]
fn nodes_that_no_surfel_holds_go_and_the_others_keep_their_ids() {
    let mut patch = Patch::new(&config().nodes);
    (0..20).for_each(|_| patch.tick(true, |_| true));
    let before = patch.nodes();
    let (left, points) = (|x: f32| x < 0.0, patch.points.clone());
    (0..2 * HELD_TICKS).for_each(|_| patch.tick(false, |slot| left(points[slot][0])));
    let after = patch.nodes();
    let spacing_m = patch.settings.spacing_m;
    assert!(after.len() < before.len() * 2 / 3, "{} of {}", after.len(), before.len());
    assert!(after.iter().all(|node| before.contains(node) && node.0.x < spacing_m));
    assert!(before.iter().filter(|node| node.0.x < -spacing_m).all(|node| after.contains(node)));
}

#[test]
fn a_full_graph_refuses_and_counts() {
    let mut small = config().nodes;
    (small.capacity, small.spacing_mm) = (256, 1.0);
    let mut patch = Patch::new(&small);
    (0..3).for_each(|_| patch.tick(true, |_| true));
    let state = patch.gpu.read(&patch.nodes.state).unwrap();
    assert_eq!((patch.nodes().len(), state[ALIVE_NODES]), (256, 256));
    assert!(state[REFUSED_NODES] > 100, "{state:?}");
}

#[test]
fn growth_is_the_same_in_every_run() {
    let run = || {
        let mut patch = Patch::new(&config().nodes);
        (0..4).for_each(|_| patch.tick(true, |_| true));
        (patch.gpu.read(&patch.nodes.rows).unwrap(), patch.gpu.read(&patch.nodes.edges).unwrap())
    };
    assert_eq!(run(), run());
}
