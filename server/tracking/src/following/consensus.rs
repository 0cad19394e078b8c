//! Whether a feature moves as its neighbours do.

use super::Step;
use crate::config::FollowingConfig;
use crate::frame::FrameFeatures;

/// For each step the share of its neighbours that agree with it; `None` where too few do.
///
/// Two steps agree where their residuals differ by no more than `agreement_px` and `strain_max` times their distance:
/// tissue bends and stretches only so far.
pub fn agreeing_shares(frame: &FrameFeatures, steps: &[Step], limits: &FollowingConfig) -> Vec<Option<f32>> {
    let mut step_of_feature = vec![None; frame.len()];
    for step in steps {
        step_of_feature[step.current] = Some(step);
    }
    let share = |step: &Step| {
        let pixel = frame.features.keypoints[step.current].pixel;
        let (mut neighbours, mut agreeing) = (0_u32, 0_u32);
        for feature in frame.grid.near(&pixel, limits.neighbour_radius_px) {
            let Some(other) = step_of_feature[feature].filter(|_| feature != step.current) else { continue };
            let distance_px = (frame.features.keypoints[feature].pixel - pixel).norm();
            if distance_px > limits.neighbour_radius_px {
                continue;
            }
            neighbours += 1;
            agreeing += u32::from(agree(step, other, distance_px, limits));
        }
        let share = agreeing as f32 / neighbours.max(1) as f32;
        (agreeing >= limits.neighbours_min && share >= limits.share_min).then_some(share)
    };
    steps.iter().map(share).collect()
}

fn agree(a: &Step, b: &Step, distance_px: f32, limits: &FollowingConfig) -> bool {
    let difference = (a.residual_px.xy() - b.residual_px.xy()).norm();
    difference <= limits.agreement_px + limits.strain_max * distance_px
}
