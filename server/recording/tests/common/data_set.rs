//! Data sets made in temporary folders.

use std::fs;
use std::path::{Path, PathBuf};

use recording::import::{ImportKind, ImportRequest, ImportSummary, import};
use recording::{RecordingError, RecordingReader, encode_png_rgb};

use super::{config, picture};

/// A rig file of the cameras of this folder's tests.
pub const RIG: &str = "frame_rate_hz = 10.0\n[rectified]\nwidth_px = 32\nheight_px = 24\nfx_px = 40.0\nfy_px = 41.0\n\
    cx_px = 15.5\ncy_px = 11.5\nright_cx_px = 14.0\nbaseline_mm = 5.0\n";

/// A data set in a temporary folder.
pub struct DataSet {
    folder: tempfile::TempDir,
}

impl DataSet {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self) -> PathBuf {
        self.folder.path().join("set")
    }

    pub fn file(&self, name: &str, content: &[u8]) -> &Self {
        let path = self.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
        self
    }

    pub fn image(&self, name: &str) -> &Self {
        self.file(name, &encode_png_rgb(&picture(name.len() as u32)).unwrap().bytes)
    }

    /// Pairs `left/NAME.png` and `right/NAME.png`.
    pub fn pairs(&self, names: &[&str]) -> &Self {
        for name in names {
            self.image(&format!("left/{name}.png")).image(&format!("right/{name}.png"));
        }
        self
    }

    pub fn recording(&self) -> PathBuf {
        self.folder.path().join("out.mcap")
    }

    pub fn import(
        &self,
        kind: ImportKind,
        calibration: Option<&Path>,
    ) -> Result<ImportSummary, RecordingError> {
        self.import_from(kind, &self.path(), calibration)
    }

    /// Imports a part of the set.
    pub fn import_from(
        &self,
        kind: ImportKind,
        source: &Path,
        calibration: Option<&Path>,
    ) -> Result<ImportSummary, RecordingError> {
        let recording = self.recording();
        let request = ImportRequest { calibration, ..ImportRequest::new(kind, source, &recording) };
        import(&request, &config(), &mut |_, _| {})
    }

    pub fn refusal(&self, kind: ImportKind) -> String {
        let told = self.import(kind, None).unwrap_err().to_string();
        let left: Vec<_> =
            fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(left, [self.path()], "a refused import leaves nothing");
        told
    }

    pub fn stamps_ms(&self) -> Vec<u64> {
        let reader = RecordingReader::open(&self.recording(), &config()).unwrap();
        super::replayed_stamps(&reader).into_iter().map(|stamp_ns| stamp_ns / 1_000_000).collect()
    }
}
