//! A model that given motions move instead of video, published by the real change set: for measuring the stream.

use std::sync::Arc;

use gpu::{FrameRecorder, Gpu, PrefixSum, StageTimer};

use crate::change_set::{EncodingSteps, HeldNodes, PublishedParts, Publisher};
use crate::node_graph::{GraphSettings, NodeStore};
use crate::store::{ALIVE, Bits, Row, STABLE, SurfelStore};
use crate::{ChangeSet, DenseConfig, DenseError, Surfel};

/// Passes of one publication.
const STAGES_MAX: u32 = 64;

/// A deformation node, and its motion since the last time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovedNode {
    /// Where it is now, world, metres.
    pub position: [f32; 3],
    /// `A` by rows: how its surroundings turned, stretched and sheared.
    pub affine: [[f32; 3]; 3],
}

/// Surfels and nodes on the GPU, in slots as they were given; ids are their places.
#[derive(Debug)]
pub struct SyntheticModel {
    gpu: Arc<Gpu>,
    timer: StageTimer,
    store: SurfelStore,
    nodes: NodeStore,
    held_nodes: HeldNodes,
    changed: PrefixSum,
    publisher: Publisher,
    slots: u32,
}

impl SyntheticModel {
    /// Room for `surfels`; none is there yet.
    ///
    /// # Errors
    /// [`DenseError::Config`], [`DenseError::Gpu`].
    pub fn new(gpu: Arc<Gpu>, config: &DenseConfig, surfels: u32) -> Result<Self, DenseError> {
        config.check()?;
        let timer = StageTimer::new(&gpu, STAGES_MAX)?;
        let store = SurfelStore::new(&gpu, surfels)?;
        let nodes = NodeStore::new(&gpu, &config.nodes)?;
        let held_nodes = HeldNodes::new(&gpu, &config.nodes)?;
        let changed = PrefixSum::new(&gpu, surfels as usize)?;
        let graph = GraphSettings { surfels, ..GraphSettings::new(&config.nodes) };
        gpu.write(&nodes.settings, 0, &[graph])?;
        let mut frame = FrameRecorder::begin(&gpu, &timer);
        store.clear_held(&mut frame);
        nodes.clear(&mut frame);
        held_nodes.clear(&mut frame);
        frame.submit().collect()?;
        let parts = PublishedParts {
            store: &store,
            nodes: &nodes,
            held_nodes: &held_nodes,
            changed: &changed,
            reach_m: graph.reach_m,
        };
        let publisher = Publisher::new(&gpu, &parts, &config.publish)?;
        Ok(Self { publisher, gpu, timer, store, nodes, held_nodes, changed, slots: surfels })
    }

    /// Puts all surfels and nodes where they are now.
    ///
    /// # Errors
    /// [`DenseError::Gpu`], where there are more than there is room for.
    pub fn set(&mut self, surfels: &[Surfel], nodes: &[MovedNode]) -> Result<(), DenseError> {
        let place = |s: &Surfel| [s.position[0], s.position[1], s.position[2], s.radius_m];
        let facing = |s: &Surfel| [s.normal[0], s.normal[1], s.normal[2], s.weight];
        let color = |s: &Surfel| [f32::from(s.color[0]), f32::from(s.color[1]), f32::from(s.color[2]), 1.0];
        let rows = |row: fn(&Surfel) -> Row| surfels.iter().map(row).collect::<Vec<Row>>();
        let history: Vec<Bits> = surfels.iter().map(|s| [s.id, s.stamp, 0, ALIVE | STABLE]).collect();
        self.gpu.write(&self.store.geometry, 0, &rows(place))?;
        self.gpu.write(&self.store.orientation, 0, &rows(facing))?;
        self.gpu.write(&self.store.appearance, 0, &rows(color))?;
        self.gpu.write(&self.store.history, 0, &history)?;
        let tagged = |(id, node): (u32, &MovedNode)| {
            let [x, y, z] = node.position.map(f32::to_bits);
            [x, y, z, id + 1]
        };
        let places: Vec<Bits> = (0..).zip(nodes).map(tagged).collect();
        let row = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
        let travelled: Vec<Row> = nodes.iter().flat_map(|node| node.affine.map(row)).collect();
        self.gpu.write(&self.nodes.rows, 0, &places)?;
        self.gpu.write(&self.nodes.travelled, 0, &travelled)?;
        Ok(())
    }

    /// As [`crate::DenseSlam::take_changes`].
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn take_changes(&mut self, steps: &EncodingSteps) -> Result<ChangeSet, DenseError> {
        let device = (&*self.gpu, &self.timer);
        Ok(self.publisher.take(device, &self.changed, &mut self.held_nodes, steps, self.slots)?)
    }

    /// As [`crate::DenseSlam::held_surfels`].
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn held_surfels(&self) -> Result<Vec<Surfel>, DenseError> {
        Ok(self.store.read_held(&self.gpu, self.slots)?)
    }
}
