//! ROS 2 bags: an MCAP file, or a bag's folder with `metadata.yaml` and one or more of them, in the order of their names.
//! Which topics hold the cameras is configured in `[recording.topics]`; the recording has its own names again.
//!
//! The pairs are copied as they are, with the calibration and what else the topics hold of the truth. Bags in SQLite
//! files must be converted first: `ros2 bag convert` with `storage_id: mcap`.

use std::path::{Path, PathBuf};

use super::record::{Unfinished, origin};
use super::{Given, ImportRequest, ImportSummary, files};
use crate::{RecordingConfig, RecordingError, RecordingReader, RecordingWriter};

pub(super) fn import(
    request: &ImportRequest,
    given: Given,
    config: &RecordingConfig,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<ImportSummary, RecordingError> {
    let parts = parts(request.source)?;
    let topics = request.bag_topics.unwrap_or(&config.topics).clone();
    let of_bag = RecordingConfig { topics, ..config.clone() };
    let readers = parts.iter().map(|path| RecordingReader::open(path, &of_bag));
    let readers = readers.collect::<Result<Vec<_>, _>>()?;
    let calibration = match given.rig {
        Some(rig) => rig.calibration,
        None => readers[0].calibration()?,
    };
    let total = readers.iter().filter_map(RecordingReader::expected_pairs).sum::<u64>() as usize;
    let unfinished = Unfinished::beside(request.recording);
    let mut copy = Copy { writer: RecordingWriter::create(&unfinished.path, config)?, summary: None };
    copy.writer.write_metadata("import", origin(request))?;
    for reader in &readers {
        for pair in reader.stereo()? {
            let pair = pair?;
            if copy.summary.is_none() {
                copy.writer.write_calibration(pair.stamp_ns, &calibration)?;
            }
            copy.writer.write_pair(pair.stamp_ns, &pair.left, &pair.right)?;
            let summary = copy.summary.get_or_insert(empty(pair.stamp_ns, calibration));
            if let Some(mask) = &pair.mask {
                copy.writer.write_mask(pair.stamp_ns, mask)?;
                summary.masks += 1;
            }
            summary.pairs += 1;
            summary.last_stamp_ns = pair.stamp_ns;
            progress(summary.pairs, total.max(summary.pairs));
        }
        copy.truth(reader)?;
    }
    let Copy { writer, summary } = copy;
    let none = || RecordingError::input(request.source, "no stereo pair could be put together");
    let summary = summary.ok_or_else(none)?;
    writer.finish()?;
    unfinished.rename_to(request.recording)?;
    Ok(summary)
}

/// A recording being written from a bag.
struct Copy {
    writer: RecordingWriter,
    /// `None` before the first pair.
    summary: Option<ImportSummary>,
}

impl Copy {
    /// True poses and depth, where a recording of our own was played into the bag.
    fn truth(&mut self, reader: &RecordingReader) -> Result<(), RecordingError> {
        let Some(summary) = &mut self.summary else { return Ok(()) };
        for pose in reader.poses()? {
            self.writer.write_truth_pose(&pose)?;
            summary.poses += 1;
        }
        for depth in reader.depths()? {
            let depth = depth?;
            self.writer.write_truth_depth(depth.stamp_ns, &depth.depth)?;
            summary.depths += 1;
        }
        Ok(())
    }
}

fn empty(first_stamp_ns: u64, calibration: crate::Calibration) -> ImportSummary {
    let last_stamp_ns = first_stamp_ns;
    ImportSummary { pairs: 0, first_stamp_ns, last_stamp_ns, masks: 0, depths: 0, poses: 0, calibration }
}

/// The MCAP files of a bag.
fn parts(source: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    if !source.is_dir() {
        return Ok(vec![source.to_path_buf()]);
    }
    let parts = files::with_extension(source, "mcap")?;
    if !parts.is_empty() {
        return Ok(parts);
    }
    let problem = match files::with_extension(source, "db3")?.first() {
        Some(_) => {
            "the bag is in SQLite files: convert it (ros2 bag convert, storage_id: mcap) and import that"
        }
        None => "no *.mcap file in this folder",
    };
    Err(RecordingError::input(source, problem))
}
