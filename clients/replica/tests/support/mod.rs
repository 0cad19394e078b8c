//! A small deforming patch and the server's side of its model lane.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use protocol::v1::{ModelEpoch, PackedNodes};
use protocol::{
    NodePosition, NodeTransform, PackedModel, WireSurfel, pack_ids, pack_nodes, pack_surfels, pack_transforms,
};

pub const REACH_M: f32 = 0.008;
const SIDE: u32 = 8;
const NODE_SIDE: u32 = 4;

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

pub fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<_> = hex.as_bytes().chunks(2).collect();
    digits.iter().map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// A surfel of a bumpy patch, 1.5 mm apart.
pub fn surfel(id: u32, lift_m: f32) -> WireSurfel {
    let (column, row) = ((id % SIDE) as f32, (id / SIDE) as f32);
    WireSurfel {
        id,
        position_in_world_m: [0.0015 * column, 0.0015 * row, 0.05 + 0.0003 * (column * row % 5.0) + lift_m],
        normal_in_world: [0.1, 0.2, -0.9],
        radius_m: 0.0008,
        color: [200, (10 * id % 256) as u8, 70],
        confidence: 0.75,
    }
}

/// A node of a 4 mm grid over the patch.
pub fn node(id: u32) -> NodePosition {
    NodePosition::pack([0.004 * (id % NODE_SIDE) as f32, 0.004 * (id / NODE_SIDE) as f32, 0.0505])
}

/// Motion of a node in a step: a wave with some shear and growth.
pub fn transform(id: u32, step: u32) -> NodeTransform {
    let wave = |phase: u32, size: i32| ((id * 31 + step * 17 + phase * 7) % 41) as i32 * size / 20 - size;
    let codes = [60, 60, 120, 90, 60, 60, 60, 90, 60, 60, 60, 90];
    NodeTransform(std::array::from_fn(|place| wave(place as u32, codes[place]) as i16))
}

pub fn nodes(ids: &[u32]) -> PackedNodes {
    let positions: Vec<_> = ids.iter().map(|&id| node(id)).collect();
    pack_nodes(ids, &positions).unwrap()
}

/// The server's side.
#[derive(Default)]
pub struct Lane {
    pub model: PackedModel,
}

impl Lane {
    /// An epoch on the model as it is, which changes nothing.
    pub fn still(&self) -> ModelEpoch {
        ModelEpoch {
            epoch: self.model.epoch() + 1,
            base_epoch: self.model.epoch(),
            stamp_ns: u64::from(self.model.epoch()) * 33_333_333,
            node_reach_m: REACH_M,
            ..ModelEpoch::default()
        }
    }

    /// An epoch with a motion of all nodes.
    pub fn warp(&self, step: u32) -> ModelEpoch {
        let transforms: Vec<_> = self.model.nodes().ids().iter().map(|&id| transform(id, step)).collect();
        ModelEpoch { node_transforms: pack_transforms(&transforms), max_error_m: 1.5e-4, ..self.still() }
    }

    pub fn advance(&mut self, step: u32) -> ModelEpoch {
        let block = |ids: std::ops::Range<u32>, lift_m| {
            let surfels: Vec<_> = ids.map(|id| surfel(id, lift_m)).collect();
            Some(pack_surfels(&surfels).unwrap())
        };
        let epoch = match step {
            0 => ModelEpoch { added: block(0..SIDE * SIDE, 0.0), ..self.still() },
            1 => {
                let added_nodes = nodes(&(0..NODE_SIDE * NODE_SIDE - 2).collect::<Vec<_>>());
                ModelEpoch { added_nodes: Some(added_nodes), ..self.still() }
            }
            2 | 4 | 6 => self.warp(step),
            3 => ModelEpoch {
                updated: block(10..20, 0.002),
                removed_ids: pack_ids(&[0, 1, 63]).unwrap(),
                added: block(70..74, -0.001),
                removed_node_ids: pack_ids(&[5]).unwrap(),
                added_nodes: Some(nodes(&[14, 15])),
                ..self.warp(step)
            },
            5 => self.still(),
            _ => ModelEpoch { removed_node_ids: pack_ids(self.model.nodes().ids()).unwrap(), ..self.still() },
        };
        self.model.advance(epoch).unwrap()
    }
}
