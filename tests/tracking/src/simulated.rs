//! Trajectory error on simulated scenes, rigid and deforming, and on the recordings that come with a true trajectory.

use std::path::Path;

use geometry::Pose;
use geometry::trajectory::ate;
use recording::import::ImportKind;
use simulator::{SceneConfig, SceneKind};
use tracking::TrackingConfig;

use crate::Error;
use crate::footage::{Footage, rigid, shared_data};
use crate::perfect::perfect_trajectory;
use crate::row::{Measured, Row};
use crate::run::{Recording, Tracked, track_all};
use crate::settings::Settings;

const MM_PER_M: f64 = 1e3;
/// Frames of the blurred jerk of `sim_liver.mcap`, with what follows until a usable image.
const SIM_LIVER_JERK: std::ops::Range<usize> = 90..106;

/// All rows with a true trajectory.
pub fn rows() -> Vec<Row> {
    let rigid = ("ATE <= 0.25 mm", "ORB-SLAM3 0.22 mm, libviso2 1.36 mm");
    let deforming = ("ATE <= 1.2 x perfect rigid tracker", "ORB-SLAM3 2.9 mm (tissue moves by 5 mm)");
    let row = |name, (target, anchor), measure| Row { name, target, anchor, measure };
    vec![
        row("rigid heart", rigid, |footage, settings| rigid_row(footage, settings, SceneKind::Heart)),
        row("rigid liver", rigid, |footage, settings| rigid_row(footage, settings, SceneKind::Liver)),
        row("rigid kidney", rigid, |footage, settings| rigid_row(footage, settings, SceneKind::Kidney)),
        row("deforming heart", deforming, |footage, settings| {
            deforming_row(footage, settings, SceneKind::Heart)
        }),
        row("deforming liver", deforming, |footage, settings| {
            deforming_row(footage, settings, SceneKind::Liver)
        }),
        row("deforming kidney", deforming, |footage, settings| {
            deforming_row(footage, settings, SceneKind::Kidney)
        }),
        row(
            "sim_liver",
            ("ATE <= 1.0 mm, none lost outside the jerk", "perfect rigid tracker 0.84 mm"),
            sim_liver,
        ),
        row("kitti/seq1", ("ATE <= 0.06 m", "ORB-SLAM3 0.04-0.06 m, libviso2 0.12 m"), kitti),
    ]
}

/// One trajectory beside the truth.
struct Flight {
    tracked: Vec<Tracked>,
    truth: Vec<Option<Pose>>,
}

impl Flight {
    fn take(name: &str, path: &Path, config: &TrackingConfig, settings: &Settings) -> Result<Self, Error> {
        let recording = Recording::open(path, &settings.recording)?;
        let tracked = track_all(name, &recording, config)?;
        let stamps_ns: Vec<u64> = tracked.iter().map(|frame| frame.stamp_ns).collect();
        Ok(Self { truth: recording.truth(&stamps_ns)?, tracked })
    }

    fn ate_m(&self) -> Option<f64> {
        let estimates = self.tracked.iter().map(|frame| frame.report.world_from_camera);
        let both = estimates.zip(&self.truth).filter_map(|(estimate, truth)| Some((estimate?, (*truth)?)));
        let (estimates, truths): (Vec<Pose>, Vec<Pose>) = both.unzip();
        Some(ate(&estimates, &truths)?.rmse_m)
    }

    fn lost(&self) -> Vec<usize> {
        let frames = self.tracked.iter().enumerate();
        frames.filter(|(_, f)| f.report.world_from_camera.is_none()).map(|(index, _)| index).collect()
    }
}

fn mm(metres: Option<f64>) -> f64 {
    metres.map_or(f64::INFINITY, |metres| metres * MM_PER_M)
}

fn rigid_row(footage: &Footage, settings: &Settings, scene: SceneKind) -> Result<Measured, Error> {
    let name = format!("rigid-{scene}");
    let path = footage.simulated(&name, &rigid(settings, scene))?;
    let flight = Flight::take(&name, &path, &settings.tracking, settings)?;
    let (ate_mm, lost) = (mm(flight.ate_m()), flight.lost().len());
    let text = format!("ATE {ate_mm:.3} mm, {lost} of {} lost", flight.tracked.len());
    Ok(Measured::new(text, ate_mm <= 0.25 && lost == 0))
}

fn deforming_row(footage: &Footage, settings: &Settings, scene: SceneKind) -> Result<Measured, Error> {
    let name = format!("deforming-{scene}");
    let path = footage.simulated(&name, &SceneConfig { scene, ..settings.scene.clone() })?;
    let flight = Flight::take(&name, &path, &settings.tracking, settings)?;
    let perfect_mm = perfect_ate_mm(&path, settings)?;
    let (ate_mm, lost) = (mm(flight.ate_m()), flight.lost().len());
    let ratio = ate_mm / perfect_mm;
    let text = format!(
        "ATE {ate_mm:.3} mm, perfect {perfect_mm:.3} mm, ratio {ratio:.2}, {lost} of {} lost",
        flight.tracked.len()
    );
    Ok(Measured::new(text, ratio <= 1.2 && lost == 0))
}

fn perfect_ate_mm(path: &Path, settings: &Settings) -> Result<f64, Error> {
    let (estimates, truths): (Vec<Pose>, Vec<Pose>) =
        perfect_trajectory(&Recording::open(path, &settings.recording)?)?.into_iter().unzip();
    Ok(mm(ate(&estimates, &truths).map(|error| error.rmse_m)))
}

fn sim_liver(_footage: &Footage, settings: &Settings) -> Result<Measured, Error> {
    let Some(path) = shared_data("sim_liver.mcap") else {
        return Ok(Measured::skipped("../shared/data/sim_liver.mcap"));
    };
    let flight = Flight::take("sim_liver", &path, &settings.tracking, settings)?;
    let perfect_mm = perfect_ate_mm(&path, settings)?;
    let ate_mm = mm(flight.ate_m());
    let lost: Vec<usize> =
        flight.lost().into_iter().filter(|frame| !SIM_LIVER_JERK.contains(frame)).collect();
    let text = format!("ATE {ate_mm:.3} mm, perfect {perfect_mm:.3} mm, lost outside the jerk: {lost:?}");
    Ok(Measured::new(text, ate_mm <= 1.0 && lost.is_empty()))
}

fn kitti(footage: &Footage, settings: &Settings) -> Result<Measured, Error> {
    let Some(path) = footage.imported(ImportKind::Kitti, "kitti/seq1")? else {
        return Ok(Measured::skipped("../shared/data/kitti/seq1"));
    };
    let flight = Flight::take("kitti/seq1", &path, &settings.driving, settings)?;
    let ate_m = flight.ate_m().unwrap_or(f64::INFINITY);
    Ok(Measured::new(format!("ATE {ate_m:.4} m, {} lost", flight.lost().len()), ate_m <= 0.06))
}
