//! Simulated scenes as recordings.

use std::collections::BTreeMap;
use std::path::Path;

use geometry::trajectory::StampedPose;
use nalgebra::Point3;
use recording::{Calibration, RecordingConfig, RecordingError, RecordingWriter, TruthPoints};
use simulator::{SceneConfig, SimulatedFrame, Simulation, SimulatorError};

/// How frames are written.
#[derive(Clone, Copy, Debug)]
pub struct Encoding {
    /// 1 to 100.
    pub jpeg_quality: u8,
    /// True depth is written for every n-th pair.
    pub depth_every: u32,
}

/// Why a scene was not recorded.
#[derive(Debug, thiserror::Error)]
pub enum SimulatedError {
    /// The scene cannot be made.
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// The same scene with nothing in it that deforms.
pub fn rigid(scene: &SceneConfig) -> SceneConfig {
    SceneConfig { deformation_mm: 0.0, respiration_mm: 0.0, beat_hz: 0.0, ..scene.clone() }
}

/// Simulates a scene into a recording with all truth channels. `progress` is told pairs done and in all.
///
/// # Errors
/// [`SimulatedError`] names the option or file.
pub fn record(
    scene: &SceneConfig,
    encoding: &Encoding,
    path: &Path,
    config: &RecordingConfig,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), SimulatedError> {
    let simulation = Simulation::new(scene)?;
    let mut writer = RecordingWriter::create(path, config)?;
    let first_ns = simulation.stamp_ns(0);
    writer.write_metadata("simulation", notes(scene))?;
    writer.write_calibration(first_ns, &Calibration::Rectified(*simulation.rig()))?;
    for number in 0..simulation.frames() {
        let frame = simulation.frame(number)?;
        write_frame(&mut writer, &frame, encoding.jpeg_quality)?;
        if number % encoding.depth_every == 0 || number + 1 == simulation.frames() {
            writer.write_truth_depth(frame.stamp_ns, &frame.depth)?;
        }
        progress(u64::from(number) + 1, u64::from(simulation.frames()));
    }
    let mesh = simulation.truth_mesh().to_npz()?;
    writer.attach(first_ns, "truth_mesh.npz", "application/octet-stream", &mesh)?;
    Ok(writer.finish()?)
}

/// What a reader of the recording may want to know of the scene.
fn notes(scene: &SceneConfig) -> BTreeMap<String, String> {
    let notes = [
        ("scene", scene.scene.to_string()),
        ("seed", scene.seed.to_string()),
        ("deformation_mm", scene.deformation_mm.to_string()),
        ("respiration_mm", scene.respiration_mm.to_string()),
    ];
    notes.map(|(key, value)| (key.to_owned(), value)).into()
}

fn write_frame(
    writer: &mut RecordingWriter,
    frame: &SimulatedFrame,
    jpeg_quality: u8,
) -> Result<(), RecordingError> {
    let left = recording::encode_jpeg(&frame.left, jpeg_quality)?;
    let right = recording::encode_jpeg(&frame.right, jpeg_quality)?;
    let stamp_ns = frame.stamp_ns;
    writer.write_pair(stamp_ns, &left, &right)?;
    writer.write_truth_pose(&StampedPose { stamp_ns, world_from_camera: frame.world_from_camera })?;
    let (ids, points_in_world) = frame.points.iter().map(|&(id, point)| (id, Point3::from(point))).unzip();
    writer.write_truth_points(&TruthPoints { stamp_ns, ids, points_in_world })
}
