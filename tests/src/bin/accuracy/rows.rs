//! The rows of the table.

use std::path::PathBuf;

use recording::import::ImportKind;
use simulator::{SceneConfig, SceneKind};

use crate::bound::Bound::{self, AtLeast, AtMost};
use crate::bound::Figure;
use crate::outcome::Outcome;
use crate::recordings::Recorded;

/// One recording, how it is replayed and what is asked of it.
#[derive(Clone, Copy)]
pub struct Row {
    /// Name, as for `--only`.
    pub name: &'static str,
    /// What is replayed.
    pub recording: Recorded,
    /// File in `config/profiles`.
    pub profile: Option<&'static str>,
    /// Options laid over it.
    pub overrides: &'static [&'static str],
    /// Whether a rigid model is always shown beside.
    pub beside_rigid: bool,
    /// First and last frame of which the model's depth is compared with the recording's.
    pub view_depth_frames: Option<(u64, u64)>,
    /// What is printed.
    pub figures: &'static [Figure],
}

impl Row {
    /// The profile's file.
    pub fn profile_path(&self) -> Option<PathBuf> {
        self.profile.map(|name| tests::data::workspace().join("config/profiles").join(name))
    }
}

/// The paper's simulation: pushes of 2-3 mm at random vertices, no breathing.
fn pushes_alone(scene: &mut SceneConfig) {
    scene.deformation_mm = 3.0;
    scene.respiration_mm = 0.0;
}

fn beating(scene: &mut SceneConfig) {
    scene.deformation_mm = 3.0;
}

const fn figure(
    label: &'static str,
    anchor: &'static str,
    bound: Bound,
    value: fn(&Outcome) -> Option<f64>,
) -> Figure {
    Figure { label, anchor, bound, value }
}

const IN_CAMERA: &str = "point error in camera, mean mm";
const EXPLAINED: &str = "non-rigid share explained";
const MOVED: &str = "points moved > 1 mm, mean mm";
const IN_WORLD: &str = "point error in world, mean mm";
const SURFACE: &str = "surface error in camera, mean mm";
const COMPLETE: &str = "completeness in camera";
const BACK_PROJECTION: &str = "back-projection, mean mm";
const SEAM: &str = "colour step across seams, levels";

const HEART: [Figure; 5] = organ(0.20, 0.35, "0.41 / 0.46 mm");
const LIVER: [Figure; 5] = organ(0.25, 0.40, "0.66 / 0.68 mm");
const KIDNEY: [Figure; 5] = organ(0.25, 0.40, "0.62 / 0.82 mm");

const fn organ(in_camera_mm: f64, moved_mm: f64, paper: &'static str) -> [Figure; 5] {
    [
        figure(IN_CAMERA, "-", AtMost(in_camera_mm), Outcome::points_in_camera_mm),
        figure(EXPLAINED, "-", AtLeast(0.7), Outcome::explained),
        figure(MOVED, "-", AtMost(moved_mm), Outcome::moved_points_mm),
        figure(IN_WORLD, paper, Bound::None, Outcome::points_in_world_mm),
        figure(SURFACE, "-", Bound::None, Outcome::surface_in_camera_mm),
    ]
}

const SIM_LIVER: [Figure; 6] = [
    figure(IN_CAMERA, "-", AtMost(0.45), Outcome::points_in_camera_mm),
    figure(EXPLAINED, "-", AtLeast(0.6), Outcome::explained),
    figure(SURFACE, "-", AtMost(0.4), Outcome::surface_in_camera_mm),
    figure(COMPLETE, "-", AtLeast(0.9), Outcome::completeness_in_camera),
    figure(IN_WORLD, "-", Bound::None, Outcome::points_in_world_mm),
    figure(SEAM, "-", Bound::None, |outcome| outcome.report.color_seam_levels),
];

const PHANTOM: [Figure; 2] = [
    figure(SURFACE, "0.28, 0.35 mm", AtMost(0.25), Outcome::surface_in_camera_mm),
    figure(COMPLETE, "-", Bound::None, Outcome::completeness_in_camera),
];

const HAMLYN: [Figure; 3] = [
    figure(BACK_PROJECTION, "0.18 mm", AtMost(0.15), Outcome::others_mm),
    figure("held-out pixels over the others", "-", AtMost(1.5), Outcome::held_out_ratio),
    figure("all pixels, mean mm", "-", Bound::None, Outcome::back_projection_mm),
];

const D4D: [Figure; 3] = [
    figure("held-out depth, frames 75-108, RMSE mm", "-", AtMost(1.0), |o| o.held_out_rmse_mm(75, 108)),
    figure("model against the set's depth, RMSE mm", "-", Bound::None, |o| o.view_depth_rmse_mm),
    figure("measurement against the same, RMSE mm", "-", Bound::None, |o| o.measured_depth_rmse_mm),
];

const fn simulated(
    name: &'static str,
    kind: SceneKind,
    adapt: fn(&mut SceneConfig),
    figures: &'static [Figure],
) -> Row {
    Row {
        name,
        recording: Recorded::Scene { kind, adapt },
        profile: None,
        overrides: &[],
        beside_rigid: false,
        view_depth_frames: None,
        figures,
    }
}

const ROWS: [Row; 7] = [
    simulated("heart", SceneKind::Heart, pushes_alone, &HEART),
    simulated("liver", SceneKind::Liver, pushes_alone, &LIVER),
    simulated("kidney", SceneKind::Kidney, pushes_alone, &KIDNEY),
    Row {
        recording: Recorded::Shared("sim_liver.mcap"),
        ..simulated("sim_liver", SceneKind::Liver, pushes_alone, &SIM_LIVER)
    },
    simulated("phantom", SceneKind::Phantom, beating, &PHANTOM),
    Row {
        recording: Recorded::Import { kind: ImportKind::Hamlyn, folder: "hamlyn/6" },
        profile: Some("hamlyn6.toml"),
        overrides: &["dense.warp.hold_out=true"],
        ..simulated("hamlyn6", SceneKind::Liver, pushes_alone, &HAMLYN)
    },
    Row {
        recording: Recorded::Import { kind: ImportKind::D4d, folder: "d4d_clip" },
        overrides: &["dense.warp.hold_out=true"],
        beside_rigid: true,
        view_depth_frames: Some((75, 108)),
        ..simulated("d4d", SceneKind::Liver, pushes_alone, &D4D)
    },
];

/// All rows, in the order of the table.
pub fn all() -> Vec<Row> {
    ROWS.to_vec()
}

#[cfg(test)]
mod checks {
    use mis_slam::config::Config;

    use super::*;

    #[test]
    fn every_row_has_a_usable_configuration() {
        for row in all() {
            let overrides: Vec<String> = row.overrides.iter().map(|&text| text.into()).collect();
            let loaded = Config::load(row.profile_path().as_deref(), &overrides);
            assert!(loaded.is_ok(), "{}: {loaded:?}", row.name);
        }
    }
}
