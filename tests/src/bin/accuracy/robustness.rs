//! The paper's robustness figure: how far the pose strays under three sources of the pose when the scope is jerked.

use std::path::Path;

use geometry::Pose;
use geometry::trajectory::StampedPose;
use mis_slam::config::Config;
use plotters::prelude::*;
use recording::RecordingReader;
use recording::export::read_tum;
use simulator::{SceneConfig, SceneKind};

use crate::arguments::{Arguments, ROBUSTNESS};
use crate::error::AccuracyError;
use crate::recordings::{self, Recorded};
use crate::replays;
use crate::report::Report;

const MODES: [(&str, RGBColor); 3] = [("slam", BLUE), ("odometry", RED), ("none", BLACK)];
const SIZE_PX: (u32, u32) = (900, 420);
const MM_PER_M: f64 = 1e3;

/// Distance (mm) of the estimated from the true camera, by frame; a frame without a pose has none.
struct Curve {
    mode: &'static str,
    color: RGBColor,
    distance_mm: Vec<(usize, f64)>,
}

/// A sudden movement of the scope by a tenth of the field of view, in the middle of the run.
fn jerked(scene: &mut SceneConfig) {
    scene.jerk_mm = 20.0;
    scene.jerk_frame = scene.frames / 2;
}

/// Replays the scene three times, writes `robustness.svg` and prints how far each strays.
pub fn run(arguments: &Arguments, report: &mut Report) -> Result<(), AccuracyError> {
    let scene = Recorded::Scene { kind: SceneKind::Abdomen, adapt: jerked };
    let Some(recording) = recordings::provide(&scene, arguments)? else { return Ok(()) };
    let curves = MODES
        .iter()
        .map(|&(mode, color)| {
            let distance_mm = distances_mm(&recording, mode, arguments)?;
            Ok(Curve { mode, color, distance_mm })
        })
        .collect::<Result<Vec<_>, AccuracyError>>()?;
    let farthest: Vec<f64> = curves.iter().map(farthest_mm).collect();
    for (curve, &distance_mm) in curves.iter().zip(&farthest) {
        let is_slam = curve.mode == "slam";
        let label = format!("{}: farthest from the true pose, mm", curve.mode);
        let met = is_slam.then(|| farthest.iter().all(|&other| distance_mm <= other));
        report.value(ROBUSTNESS, &label, Some(distance_mm), met);
    }
    draw(&curves, &report.directory().join("robustness.svg"))
}

fn farthest_mm(curve: &Curve) -> f64 {
    curve.distance_mm.iter().map(|&(_, distance_mm)| distance_mm).fold(0.0, f64::max)
}

fn distances_mm(
    recording: &Path,
    mode: &str,
    arguments: &Arguments,
) -> Result<Vec<(usize, f64)>, AccuracyError> {
    let mut overrides = arguments.overrides.clone();
    overrides.push(format!("tracking.mode={mode}"));
    let config = Config::load(None, &overrides)?;
    let directory = arguments.work.join(format!("{ROBUSTNESS}-{mode}"));
    replays::replay(recording, &directory, &config)?;
    let truth = RecordingReader::open(recording, &config.recording)?.poses()?;
    let estimated = read_tum(&directory.join("trajectory.tum"))?;
    let Some(first) = truth.first() else { return Ok(Vec::new()) };
    let world_from_recorded = first.world_from_camera.inverse();
    let distance = |(frame, real): (usize, &StampedPose)| {
        let near = |pose: &&StampedPose| pose.stamp_ns.abs_diff(real.stamp_ns) < 1_000_000;
        let found = estimated.iter().find(near)?;
        let real: Pose = world_from_recorded * real.world_from_camera;
        let apart = found.world_from_camera.translation.vector - real.translation.vector;
        Some((frame, apart.norm() * MM_PER_M))
    };
    Ok(truth.iter().enumerate().filter_map(distance).collect())
}

fn draw(curves: &[Curve], path: &Path) -> Result<(), AccuracyError> {
    plot(curves, path)
        .map_err(|problem| AccuracyError::Figure { path: path.to_path_buf(), problem: problem.to_string() })
}

fn plot(curves: &[Curve], path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let frames = curves.iter().filter_map(|curve| curve.distance_mm.last()).map(|&(frame, _)| frame).max();
    let highest = curves.iter().map(farthest_mm).fold(1.0, f64::max);
    let area = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(12)
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d(0..frames.unwrap_or(1), 0.0..highest * 1.05)?;
    chart.configure_mesh().x_desc("frame").y_desc("distance from the true pose, mm").draw()?;
    for curve in curves {
        let color = curve.color;
        chart
            .draw_series(LineSeries::new(curve.distance_mm.iter().copied(), color.stroke_width(2)))?
            .label(format!("tracking.mode = {}", curve.mode))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}
