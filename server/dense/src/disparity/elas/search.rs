//! The parameters as the kernels take them.

use bytemuck::{Pod, Zeroable};

use super::config::ElasConfig;
use crate::disparity::band::Band;

/// The published parameters count quarters of the Sobel responses, the descriptors hold them in full.
const RESPONSE_SCALE: u32 = 4;

/// Energies count sixteenths of a difference as the parameters count it.
const STEPS_PER_COST: f64 = 16.0;

/// `Search` of `search.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Search {
    pub step: u32,
    pub columns: u32,
    pub rows: u32,
    pub cell: u32,
    pub cell_columns: u32,
    pub cell_rows: u32,
    pub mask_words: u32,
    pub support_texture: u32,
    pub match_texture: u32,
    pub support_threshold: f32,
    pub lr_threshold: f32,
    pub incon_window: i32,
    pub incon_threshold: i32,
    pub incon_min_support: u32,
    pub redun_max_dist: i32,
    pub redun_threshold: i32,
    pub radius: i32,
    pub rise_sigma: f32,
    pub prior_alone: u32,
    padding: u32,
    pub bonus: [[u32; 4]; 4],
}

impl Search {
    pub fn new(whole: &Band, config: &ElasConfig) -> Self {
        let step = config.candidate_stepsize;
        let cell = config.grid_size;
        let bonus = |distance: usize| {
            let density = (-0.5 * (distance as f64 / config.sigma).powi(2)).exp();
            (STEPS_PER_COST * (1.0 + density / config.gamma).ln() / config.beta).round().min(1e6) as u32
        };
        Self {
            step,
            columns: whole.width.div_ceil(step),
            rows: whole.height.div_ceil(step),
            cell,
            cell_columns: whole.width.div_ceil(cell),
            cell_rows: whole.height.div_ceil(cell),
            mask_words: (16 * whole.groups).div_ceil(32),
            support_texture: RESPONSE_SCALE * config.support_texture,
            match_texture: RESPONSE_SCALE * config.match_texture,
            support_threshold: config.support_threshold as f32,
            lr_threshold: config.lr_threshold as f32,
            incon_window: config.incon_window_size as i32,
            incon_threshold: config.incon_threshold as i32,
            incon_min_support: config.incon_min_support,
            redun_max_dist: config.redun_max_dist as i32,
            redun_threshold: config.redun_threshold as i32,
            radius: config.radius() as i32,
            rise_sigma: RESPONSE_SCALE as f32 * config.rise_sigma_px as f32,
            prior_alone: config.prior_alone.into(),
            padding: 0,
            bonus: [0, 4, 8, 12].map(|first| [0, 1, 2, 3].map(|next| bonus(first + next))),
        }
    }

    /// Candidates for support points.
    pub fn candidates(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// Words of the bit sets of both views.
    pub fn mask_len(&self) -> usize {
        2 * self.cell_columns as usize * self.cell_rows as usize * self.mask_words as usize
    }
}
