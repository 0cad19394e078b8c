//! `mis-slam import`: a data set becomes a recording.

use std::path::PathBuf;

use clap::Args;
use recording::import::{self, ImportKind, ImportRequest};

use super::progress::Progress;
use super::{Failure, Outcome};
use crate::config::Config;

/// Turn a data set into a recording; images are copied as they are.
#[derive(Debug, Args)]
pub struct Import {
    /// folder, hamlyn, bdis, kitti, euroc or d4d.
    kind: ImportKind,
    /// The data set's folder.
    path: PathBuf,
    /// The recording to write.
    #[arg(short, long, value_name = "REC.mcap")]
    output: PathBuf,
    /// A rig file (config/rigs/*.toml) in place of the data set's own calibration.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
}

impl Import {
    pub(super) fn run(self, config: &Config) -> Outcome {
        let request = ImportRequest {
            kind: self.kind,
            source: &self.path,
            calibration: self.calibration.as_deref(),
            recording: &self.output,
        };
        let mut progress = Progress::new("import");
        let imported = import::import(&request, &config.recording, &mut |done, total| {
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
