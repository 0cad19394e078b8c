//! What the recording of a run tells: where it comes from, its images, and what is true of it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use evaluation::{ComparedSurfaces, Evaluation, Truth};
use geometry::trajectory::StampedPose;
use geometry::{DepthMap, Rgb};
use recording::{RecordingConfig, RecordingReader};

use crate::ReportingError;
use crate::run::Run;

/// A run's recording; empty where there is none.
#[derive(Default)]
pub(crate) struct Known {
    /// File name of the recording.
    pub name: Option<String>,
    /// Why there is no recording.
    pub absent: Option<String>,
    /// What its writer noted, by group.
    pub notes: BTreeMap<String, BTreeMap<String, String>>,
    pub scores: Option<Evaluation>,
    pub surfaces: Option<ComparedSurfaces>,
    /// In the world of the first left camera.
    pub true_trajectory: Vec<StampedPose>,
    /// Numbers and stamps of pairs that have a true depth map.
    pub true_depth_stamps_ns: Vec<u64>,
    /// Stamps of the pairs.
    pub stamps_ns: Vec<u64>,
    reader: Option<RecordingReader>,
}

impl Known {
    /// Opens the recording that is given, or that the run names.
    ///
    /// # Errors
    /// [`ReportingError`] for a recording that is given and cannot be read, or a damaged result file.
    pub fn of(run: &Run, given: Option<&Path>, config: &RecordingConfig) -> Result<Self, ReportingError> {
        let path = match (given, &run.figures.recording) {
            (Some(path), _) => path.to_path_buf(),
            (None, Some(path)) if path.is_file() => path.clone(),
            (None, Some(path)) => {
                return Ok(Self::absent(format!(
                    "{} is no longer where it was replayed from",
                    file_name(path)
                )));
            }
            (None, None) => return Ok(Self::absent("the run does not tell it".into())),
        };
        let reader = RecordingReader::open(&path, config)?;
        let refused = ReportingError::evaluation(&run.directory);
        let truth = Truth::read(&reader).map_err(&refused)?;
        let scores = evaluation::evaluate(&run.directory, &truth).map_err(&refused)?;
        let surfaces = evaluation::compared_surfaces(&run.directory, &truth).map_err(&refused)?;
        let (true_trajectory, stamps_ns) = (truth.trajectory(), truth.frame_stamps_ns().to_vec());
        let depth_stamps = reader.depths()?.map(|depth| Ok::<_, ReportingError>(depth?.stamp_ns));
        let true_depth_stamps_ns = depth_stamps.collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            name: Some(file_name(&path)),
            absent: None,
            notes: reader.metadata()?,
            scores: Some(scores),
            surfaces,
            true_trajectory,
            true_depth_stamps_ns,
            stamps_ns,
            reader: Some(reader),
        })
    }

    fn absent(why: String) -> Self {
        Self { absent: Some(why), ..Self::default() }
    }

    /// A note of the recording's writer.
    pub fn note(&self, group: &str, key: &str) -> Option<&str> {
        Some(self.notes.get(group)?.get(key)?.as_str())
    }

    /// The left images of some pairs.
    pub fn images(&self, frames: &[u64]) -> Result<BTreeMap<u64, Rgb>, ReportingError> {
        let mut images = BTreeMap::new();
        let Some(reader) = &self.reader else { return Ok(images) };
        let size_px = reader.calibration()?.image_size_px();
        for (number, pair) in (0..).zip(reader.stereo()?) {
            if frames.contains(&number)
                && let Ok(image) = recording::decode_rgb(&pair?.left, size_px)
            {
                images.insert(number, image);
            }
        }
        Ok(images)
    }

    /// The true depth of some pairs.
    pub fn depths(&self, frames: &[u64]) -> Result<BTreeMap<u64, DepthMap>, ReportingError> {
        let mut depths = BTreeMap::new();
        let Some(reader) = &self.reader else { return Ok(depths) };
        for depth in reader.depths()? {
            let depth = depth?;
            let number = self.stamps_ns.binary_search(&depth.stamp_ns).ok().map(|number| number as u64);
            if let Some(number) = number.filter(|number| frames.contains(number)) {
                depths.insert(number, depth.depth);
            }
        }
        Ok(depths)
    }

    /// Numbers of the pairs with a true depth map.
    pub fn frames_with_depth(&self) -> Vec<u64> {
        let number = |stamp_ns: &u64| self.stamps_ns.binary_search(stamp_ns).ok().map(|number| number as u64);
        self.true_depth_stamps_ns.iter().filter_map(number).collect()
    }
}

fn file_name(path: &Path) -> String {
    PathBuf::from(path).file_name().unwrap_or_default().to_string_lossy().into_owned()
}
