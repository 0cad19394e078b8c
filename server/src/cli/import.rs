//! `mis-slam import`: a data set becomes a recording.

use std::path::PathBuf;

use clap::Args;
use recording::RecordingConfig;
use recording::import::{self, ImportKind, ImportRequest};

use super::progress::Progress;
use super::{Failure, Outcome};
use crate::config::Config;

/// Turn a data set, a bag or a video into a recording; images are copied as they are.
#[derive(Debug, Args)]
pub struct Import {
    /// folder, hamlyn, bdis, kitti, euroc, d4d, scared, stereomis, servct, endonerf, ros2bag or video.
    kind: ImportKind,
    /// The data set's folder, or the video or bag.
    path: PathBuf,
    /// The recording to write.
    #[arg(short, long, value_name = "REC.mcap")]
    output: PathBuf,
    /// A calibration in place of the data set's own: a rig file (config/rigs/*.toml), OpenCV, ROS or Kalibr
    /// YAML, a StereoMIS INI file, or a folder with one of these or with Hamlyn text files; server/recording/README.md
    /// tells more.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Length of one unit of a calibration that does not tell its unit (OpenCV), millimetres.
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    calibration_unit_mm: f64,
    /// Images a second, in place of the data set's own times.
    #[arg(long, value_name = "HZ")]
    frame_rate: Option<f64>,
}

impl Import {
    pub(super) fn run(self, config: &Config) -> Outcome {
        let request = ImportRequest {
            kind: self.kind,
            source: &self.path,
            calibration: self.calibration.as_deref(),
            calibration_unit_m: self.calibration_unit_mm * 1e-3,
            frame_rate_hz: self.frame_rate,
            bag_topics: Some(&config.recording.topics),
            recording: &self.output,
        };
        // What is set of the topics is where a bag has them; a recording has them where all readers look.
        let topics = Config::load(None, &[])?.recording.topics;
        let recording = RecordingConfig { topics, ..config.recording.clone() };
        let mut progress = Progress::new("import");
        let imported = import::import(&request, &recording, &mut |done, total| {
            progress.set(done as u64, Some(total as u64));
        });
        progress.finish();
        let summary = imported.map_err(Failure::bad_input)?;
        let (width_px, height_px) = summary.calibration.image_size_px();
        println!(
            "{}: {} pairs of {width_px}x{height_px} over {:.1} s, {} masks, {} true depth maps, {} true poses",
            self.output.display(),
            summary.pairs,
            (summary.last_stamp_ns - summary.first_stamp_ns) as f64 * 1e-9,
            summary.masks,
            summary.depths,
            summary.poses
        );
        Ok(())
    }
}
