//! The recordings that are measured on: simulated or imported once, then kept.

use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::Point3;
use recording::import::{ImportKind, ImportRequest, import};
use recording::{Calibration, RecordingConfig, RecordingWriter, TruthPoints};
use simulator::{SceneConfig, SceneKind, Simulation};

use crate::Error;
use crate::settings::Settings;

const JPEG_QUALITY: u8 = 95;
/// True depth is written for every n-th pair.
const DEPTH_EVERY: u32 = 5;

/// The workspace's root.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A file or folder of the shared research data; `None` where this machine has none.
pub fn shared_data(relative: &str) -> Option<PathBuf> {
    let path = workspace().join("../shared/data").join(relative);
    path.exists().then_some(path)
}

/// Where recordings are kept.
pub struct Footage {
    directory: PathBuf,
    recording: RecordingConfig,
}

impl Footage {
    /// Opens the cache.
    ///
    /// # Errors
    /// A directory that cannot be made.
    pub fn new(settings: &Settings) -> Result<Self, Error> {
        let directory = workspace().join("target/tracking-evaluation");
        std::fs::create_dir_all(&directory)?;
        Ok(Self { directory, recording: settings.recording.clone() })
    }

    /// A simulated scene; its name tells all that differs from the defaults.
    ///
    /// # Errors
    /// What the simulator or the writer refuses.
    pub fn simulated(&self, name: &str, scene: &SceneConfig) -> Result<PathBuf, Error> {
        self.kept(name, |path| simulate(path, name, scene, &self.recording))
    }

    /// A shared data set; `None` where this machine has none.
    ///
    /// # Errors
    /// What the importer refuses.
    pub fn imported(&self, kind: ImportKind, relative: &str) -> Result<Option<PathBuf>, Error> {
        let Some(source) = shared_data(relative) else { return Ok(None) };
        let name = relative.replace('/', "-");
        let made = self.kept(&name, |recording| {
            let request = ImportRequest::new(kind, &source, recording);
            import(&request, &self.recording, &mut |_, _| {})?;
            Ok(())
        });
        made.map(Some)
    }

    /// The recording of this name; made under another name first, so that one that was broken off is not kept.
    fn kept(&self, name: &str, make: impl FnOnce(&Path) -> Result<(), Error>) -> Result<PathBuf, Error> {
        let path = self.directory.join(name).with_extension("mcap");
        if !path.exists() {
            let unfinished = path.with_extension("unfinished");
            make(&unfinished)?;
            std::fs::rename(&unfinished, &path)?;
        }
        Ok(path)
    }
}

/// A scene of the defaults with nothing that deforms.
pub fn rigid(settings: &Settings, scene: SceneKind) -> SceneConfig {
    SceneConfig { scene, deformation_mm: 0.0, respiration_mm: 0.0, ..settings.scene.clone() }
}

/// A bar for something that takes `steps`.
pub fn progress(name: &str, steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:>24} {wide_bar} {pos}/{len} eta {eta}");
    let bar = ProgressBar::new(steps).with_prefix(name.to_string());
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

fn simulate(path: &Path, name: &str, scene: &SceneConfig, config: &RecordingConfig) -> Result<(), Error> {
    let simulation = Simulation::new(scene)?;
    let mut writer = RecordingWriter::create(path, config)?;
    writer.write_calibration(simulation.stamp_ns(0), &Calibration::Rectified(*simulation.rig()))?;
    let bar = progress(&format!("simulate {name}"), u64::from(simulation.frames()));
    for number in 0..simulation.frames() {
        let frame = simulation.frame(number)?;
        let stamp_ns = frame.stamp_ns;
        let [left, right] =
            [&frame.left, &frame.right].map(|image| recording::encode_jpeg(image, JPEG_QUALITY));
        writer.write_pair(stamp_ns, &left?, &right?)?;
        writer.write_truth_pose(&StampedPose { stamp_ns, world_from_camera: frame.world_from_camera })?;
        let (ids, points_in_world) = frame.points.iter().map(|&(id, at)| (id, Point3::from(at))).unzip();
        writer.write_truth_points(&TruthPoints { stamp_ns, ids, points_in_world })?;
        if number % DEPTH_EVERY == 0 {
            writer.write_truth_depth(stamp_ns, &frame.depth)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(writer.finish()?)
}
