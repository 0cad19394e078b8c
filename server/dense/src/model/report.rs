//! What one frame did to the model.

use super::WarpReport;
use crate::config::DenseConfig;
use crate::fusion::FusionSettings;
use crate::statistics::BackProjection;

/// Why a frame was not fused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DiscardReason {
    /// The tracker had no pose.
    NoPose,
    /// The model under the tracker's pose was too far from the observed depth.
    BackProjectionError,
}

impl DiscardReason {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoPose => "no_pose",
            Self::BackProjectionError => "back_projection_error",
        }
    }
}

/// Result block of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionReport {
    /// `None` where the frame was fused.
    pub discarded: Option<DiscardReason>,
    /// Surfels registered to a pixel.
    pub registered: u32,
    /// New surfels.
    pub lifted: u32,
    /// New surfels for which the model had no room.
    pub refused: u32,
    /// Surfels after the frame.
    pub surfels: u32,
    /// Stable ones among them.
    pub stable: u32,
    /// How the model deformed before it was fused.
    pub warp: WarpReport,
    /// Pixels with a measured depth.
    pub measured_pixels: u32,
    /// Error of the model before the frame was fused; `None` where nothing of it was in view.
    pub back_projection: Option<BackProjection>,
}

impl FusionReport {
    /// From the results (places in `shared/fusion.wgsl`), the surfels before the frame (alive, stable) and the number of
    /// pixels that won a cell.
    pub(crate) fn new(
        results: &[u32],
        (alive, stable): (u32, u32),
        (wanted, settings): (u32, &FusionSettings),
        warp: WarpReport,
        config: &DenseConfig,
    ) -> Self {
        let &[measured_pixels, accepted, died, became_stable, registered, lost_stability, ..] = results
        else {
            unreachable!("the result block has a fixed length");
        };
        let lifted = wanted.min(settings.capacity - settings.slots);
        Self {
            discarded: (accepted == 0).then_some(DiscardReason::BackProjectionError),
            registered,
            lifted,
            refused: wanted - lifted,
            surfels: alive - died + lifted,
            stable: stable + became_stable - lost_stability,
            warp,
            measured_pixels,
            back_projection: BackProjection::from_results(results, config.rejection.error_bin_mm * 1e-3),
        }
    }
}
