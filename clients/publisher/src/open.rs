//! What can be streamed: a recording, or a folder of image pairs; looked at before the first pair leaves.

use std::path::{Path, PathBuf};

use geometry::{RigLimits, validate};
use recording::import::{ImportKind, ImportRequest, import};
use recording::{Calibration, RecordingConfig, RecordingReader};
use tempfile::TempDir;

use crate::CartError;

/// A source of pairs, found to make sense.
pub(crate) struct Source {
    pub reader: RecordingReader,
    pub calibration: Calibration,
    /// Holds what a folder was turned into.
    _scratch: Option<TempDir>,
}

impl Source {
    /// Opens a recording, or a folder with `left/`, `right/` and a rig file. Cameras and the first pair are checked.
    /// Reads files: not for the async runtime.
    ///
    /// # Errors
    /// [`CartError`] names what is wrong: the file, the camera's field, the eye.
    pub fn open(
        path: &Path,
        rig_file: Option<&Path>,
        (recording, limits): (&RecordingConfig, &RigLimits),
    ) -> Result<Self, CartError> {
        let (path, scratch) = if path.is_dir() {
            let (path, scratch) = as_recording(path, rig_file, recording)?;
            (path, Some(scratch))
        } else {
            (path.to_path_buf(), None)
        };
        let reader = RecordingReader::open(&path, recording)?;
        let calibration = reader.calibration()?;
        match &calibration {
            Calibration::Rectified(rig) => validate::check_rig(rig, limits)?,
            Calibration::Raw(raw) => validate::check_calibration(raw, limits)?,
        }
        check_first_pair(&reader, calibration.image_size_px())?;
        Ok(Self { reader, calibration, _scratch: scratch })
    }
}

/// Images are copied as they are.
fn as_recording(
    folder: &Path,
    rig_file: Option<&Path>,
    config: &RecordingConfig,
) -> Result<(PathBuf, TempDir), CartError> {
    let scratch = tempfile::tempdir().map_err(|source| CartError::Scratch { source })?;
    let recording = scratch.path().join("folder.mcap");
    let request =
        ImportRequest { calibration: rig_file, ..ImportRequest::new(ImportKind::Folder, folder, &recording) };
    import(&request, config, &mut |_, _| {})?;
    Ok((recording, scratch))
}

/// Both images are decoded once, so that a wrong size or format is told here and not by every pair.
fn check_first_pair(reader: &RecordingReader, size_px: (u32, u32)) -> Result<(), CartError> {
    let first = reader.stereo()?.next().transpose()?.ok_or(CartError::Empty)?;
    for (eye, image) in [("left", &first.left), ("right", &first.right)] {
        recording::decode_rgb(image, size_px)
            .map_err(|source| CartError::FirstPair { eye, source: Box::new(source) })?;
    }
    Ok(())
}
