//! A surfel on the CPU.

use bytemuck::{Pod, Zeroable};

use super::{ALIVE, Bits, Row, STABLE};

/// An oriented disc of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfel {
    /// Unique in the session, never used again.
    pub id: u32,
    /// Centre in the world, metres.
    pub position: [f32; 3],
    /// Unit normal in the world.
    pub normal: [f32; 3],
    /// Radius of the disc, metres.
    pub radius_m: f32,
    /// The paper's omega: sum of measurement weights, at most `omega_max`.
    pub weight: f32,
    /// Red, green, blue.
    pub color: [u8; 3],
    /// Index of the frame that last saw it (as of this copy).
    pub stamp: u32,
}

/// The rows of a run of slots.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SurfelRows {
    pub geometry: Vec<Row>,
    pub orientation: Vec<Row>,
    pub appearance: Vec<Row>,
    pub history: Vec<Bits>,
}

/// `Record` of `emit_changes.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct RecordRow {
    pub geometry: Row,
    pub orientation: Row,
    /// Id, packed colour, frame last seen, kind.
    pub rest: Bits,
}

impl RecordRow {
    pub fn surfel(&self) -> Surfel {
        let [id, color, stamp, _] = self.rest;
        let [x, y, z, radius_m] = self.geometry;
        let [nx, ny, nz, weight] = self.orientation;
        let [red, green, blue, _] = color.to_le_bytes();
        Surfel {
            id,
            position: [x, y, z],
            normal: [nx, ny, nz],
            radius_m,
            weight,
            color: [red, green, blue],
            stamp,
        }
    }
}

impl SurfelRows {
    /// Rows of stable surfels.
    pub fn of(surfels: &[Surfel]) -> Self {
        let mut rows = Self::default();
        for surfel in surfels {
            let ([x, y, z], [nx, ny, nz]) = (surfel.position, surfel.normal);
            let [red, green, blue] = surfel.color.map(f32::from);
            rows.geometry.push([x, y, z, surfel.radius_m]);
            rows.orientation.push([nx, ny, nz, surfel.weight]);
            rows.appearance.push([red, green, blue, 1.0]);
            rows.history.push([surfel.id, surfel.stamp, surfel.stamp, ALIVE | STABLE]);
        }
        rows
    }

    /// The stable surfels in slot order, which is id order.
    pub fn stable(&self) -> Vec<Surfel> {
        let wanted = ALIVE | STABLE;
        let slots = (0..self.history.len()).filter(|&slot| self.history[slot][3] & wanted == wanted);
        slots.map(|slot| self.record(slot).surfel()).collect()
    }

    fn record(&self, slot: usize) -> RecordRow {
        let [id, stamp, _, _] = self.history[slot];
        let [red, green, blue, _] = self.appearance[slot].map(color_byte);
        let color = u32::from_le_bytes([red, green, blue, 0xFF]);
        RecordRow {
            geometry: self.geometry[slot],
            orientation: self.orientation[slot],
            rest: [id, color, stamp, 0],
        }
    }
}

/// WGSL's `round` takes ties to even.
fn color_byte(level: f32) -> u8 {
    level.round_ties_even().clamp(0.0, 255.0) as u8
}
