//! `[dense.nodes]` and its GPU side, `GraphSettings` of `shared/graph.wgsl`.

use bytemuck::{Pod, Zeroable};
use serde::Deserialize;

use crate::DenseError;
use crate::config::{metres, require};

/// Reach of a node in spacings; see the rule in this folder's `mod.rs`.
const REACH_SPACINGS: f32 = 2.0;
/// The most node slots; `place_nodes` gives each of its invocations an equal run of them.
const CAPACITY_LIMIT: u32 = 65_536;

/// `[dense.nodes]`: the deformation nodes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodeConfig {
    /// Distance of nodes.
    pub spacing_mm: f64,
    /// The most nodes; where there are as many, the model grows on without new ones.
    pub capacity: u32,
}

impl NodeConfig {
    /// Checks what the kernels rely on.
    pub(crate) fn check(&self) -> Result<(), DenseError> {
        let spacing = self.spacing_mm;
        let usable = spacing.is_finite() && spacing > 0.0;
        require(usable, "dense.nodes.spacing_mm", spacing, "a finite number above 0")?;
        let held = (256..=CAPACITY_LIMIT).contains(&self.capacity) && self.capacity.is_power_of_two();
        let requirement = "a power of two from 256 to 65536";
        require(held, "dense.nodes.capacity", f64::from(self.capacity), requirement)
    }
}

/// Settings of one frame; metres.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GraphSettings {
    pub surfels: u32,
    pub frame: u32,
    pub tick: u32,
    pub bucket_mask: u32,
    pub claim_mask: u32,
    pub reach_m: f32,
    pub cells_per_metre: f32,
    pub spacing_m: f32,
    pub claim_cells_per_metre: f32,
}

impl GraphSettings {
    /// What stays the same from frame to frame; the counters are zero.
    pub fn new(config: &NodeConfig) -> Self {
        let spacing_m = metres(config.spacing_mm);
        let reach_m = REACH_SPACINGS * spacing_m;
        Self {
            bucket_mask: Self::table_places(config) - 1,
            claim_mask: Self::table_places(config) - 1,
            reach_m,
            cells_per_metre: 1.0 / reach_m,
            spacing_m,
            claim_cells_per_metre: 1.0 / spacing_m,
            ..Self::zeroed()
        }
    }

    /// Places in each of the two tables: twice as many as there are nodes.
    pub fn table_places(config: &NodeConfig) -> u32 {
        2 * config.capacity
    }
}
