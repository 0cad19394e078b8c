//! Whether a feature moves as its neighbours do, and how they move.

use nalgebra::Vector2;

use super::Step;
use crate::config::FollowingConfig;
use crate::frame::FrameFeatures;

/// What a step's neighbours say about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consensus {
    /// Share of the neighbours that agree.
    pub share: f32,
    /// Mean motion of the step and those that agree with it, beyond the camera's, px. Features are found to about a pixel; their mean
    /// tells much smaller motions of the tissue from none.
    pub mean_px: Vector2<f32>,
}

/// What the neighbours say about each step; `None` where too few agree with it.
///
/// Two steps agree where their residuals differ by no more than `agreement_px` and `strain_max` times their distance:
/// tissue bends and stretches only so far.
pub fn consensus(frame: &FrameFeatures, steps: &[Step], limits: &FollowingConfig) -> Vec<Option<Consensus>> {
    let mut step_of_feature = vec![None; frame.len()];
    for step in steps {
        step_of_feature[step.current] = Some(step);
    }
    let of_step = |step: &Step| {
        let pixel = frame.features.keypoints[step.current].pixel;
        let (mut neighbours, mut agreeing, mut sum_px) = (0_u32, 0_u32, step.residual_px.xy());
        for feature in frame.grid.near(&pixel, limits.neighbour_radius_px) {
            let Some(other) = step_of_feature[feature].filter(|_| feature != step.current) else { continue };
            let distance_px = (frame.features.keypoints[feature].pixel - pixel).norm();
            if distance_px > limits.neighbour_radius_px {
                continue;
            }
            neighbours += 1;
            if agree(step, other, distance_px, limits) {
                agreeing += 1;
                sum_px += other.residual_px.xy();
            }
        }
        let share = agreeing as f32 / neighbours.max(1) as f32;
        let accepted = agreeing >= limits.neighbours_min && share >= limits.share_min;
        accepted.then(|| Consensus { share, mean_px: sum_px / (agreeing + 1) as f32 })
    };
    steps.iter().map(of_step).collect()
}

fn agree(a: &Step, b: &Step, distance_px: f32, limits: &FollowingConfig) -> bool {
    let difference = (a.residual_px.xy() - b.residual_px.xy()).norm();
    difference <= limits.agreement_px + limits.strain_max * distance_px
}
