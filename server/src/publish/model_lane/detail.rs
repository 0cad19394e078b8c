//! How much of the model a viewer gets: all of it, or everything near its gaze and a share of the rest.

use protocol::{PackedModel, ProtocolError, surfel_digest};

/// What a viewer has said that it wants.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewerWishes {
    /// What it looks at.
    pub gaze_in_world_m: Option<[f32; 3]>,
    /// Surfels at most.
    pub surfels_max: Option<usize>,
    /// Bytes a second at most.
    pub bytes_per_s_max: Option<u32>,
}

/// Which surfels a thinned viewer gets: half of its number nearest to the gaze, the others spread over the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Detail {
    gaze_in_world_m: [f32; 3],
    full_within_m: f32,
    /// Of the surfels further off those whose hash is below this.
    hash_below: u32,
}

impl Detail {
    /// Such that about `surfels` of `model` are left.
    pub fn of(model: &PackedModel, surfels: usize, gaze_in_world_m: [f32; 3]) -> Self {
        let near = surfels / 2;
        let position = |record: &protocol::SurfelRecord| record.position_in_world_m();
        let mut distances_m: Vec<f32> =
            model.surfels().rows().iter().map(|row| distance_m(position(row), gaze_in_world_m)).collect();
        let full_within_m = if near < distances_m.len() {
            *distances_m.select_nth_unstable_by(near, f32::total_cmp).1
        } else {
            f32::INFINITY
        };
        let rest = distances_m.len().saturating_sub(near).max(1);
        let share = (surfels - near) as f64 / rest as f64;
        let hash_below = (share.min(1.0) * f64::from(u32::MAX)) as u32;
        Self { gaze_in_world_m, full_within_m, hash_below }
    }

    /// Whether a surfel belongs to it.
    pub fn admits(&self, id: u32, position_in_world_m: [f32; 3]) -> bool {
        // A hash that has nothing to do with where surfels lie, the same for a surfel at all times.
        distance_m(position_in_world_m, self.gaze_in_world_m) < self.full_within_m
            || surfel_digest(id, 0) < self.hash_below
    }

    /// The part of the model that belongs to it.
    pub fn thin(&self, model: &PackedModel) -> Result<PackedModel, ProtocolError> {
        model.thinned(|id, position| self.admits(id, position))
    }
}

pub(super) fn distance_m(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
}
