//! Data sets of images and calibration files to recordings.
//!
//! Each importer is a function from a folder to a [`Plan`]: which files make a frame, when it was, what is known of
//! it. One function, [`import`], records any plan; images are copied as the bytes they are.

mod bdis;
mod d4d;
mod euroc;
mod files;
mod folder;
mod hamlyn;
mod kitti;
mod opencv_yaml;
mod record;

use std::fmt::{Display, Formatter};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use geometry::Pose;

use crate::{Calibration, RecordingConfig, RecordingError, RigFile};

/// The layouts of data sets that are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImportKind {
    /// `left/` and `right/` of image pairs with equal names, and a rig file.
    Folder,
    /// Hamlyn in-vivo data: `left/`, `right/`, the frame's number in the name.
    Hamlyn,
    /// Rendered colon and stomach: `left/`, `right/`, `depth_rg/`.
    Bdis,
    /// KITTI odometry: `image_l/`, `image_r/`, `calib.txt`, `poses.txt`.
    Kitti,
    /// EuRoC MAV: sensor files, images named by nanoseconds, ground truth of the body.
    Euroc,
    /// A clip with instruments: `left/`, `right/`, `mask/`, `depth16/`.
    D4d,
}

impl ImportKind {
    /// Every kind.
    pub const ALL: [Self; 6] = [Self::Folder, Self::Hamlyn, Self::Bdis, Self::Kitti, Self::Euroc, Self::D4d];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Folder => "folder",
            Self::Hamlyn => "hamlyn",
            Self::Bdis => "bdis",
            Self::Kitti => "kitti",
            Self::Euroc => "euroc",
            Self::D4d => "d4d",
        }
    }
}

impl Display for ImportKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ImportKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        let known = Self::ALL.into_iter().find(|kind| kind.name() == name);
        known.ok_or_else(|| format!("{name:?} is no kind of data set; {} are", names()))
    }
}

/// What to import, and where to.
#[derive(Clone, Copy, Debug)]
pub struct ImportRequest<'a> {
    /// The layout of the data set.
    pub kind: ImportKind,
    /// Its folder.
    pub source: &'a Path,
    /// A rig file to use in place of the data set's own calibration.
    pub calibration: Option<&'a Path>,
    /// The recording to write; it appears once it is complete.
    pub recording: &'a Path,
}

/// What was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportSummary {
    /// Stereo pairs.
    pub pairs: usize,
    /// Stamp of the first.
    pub first_stamp_ns: u64,
    /// Stamp of the last.
    pub last_stamp_ns: u64,
    /// Instrument masks.
    pub masks: usize,
    /// True depth maps.
    pub depths: usize,
    /// True poses.
    pub poses: usize,
    /// The calibration.
    pub calibration: Calibration,
}

/// Imports a data set; `progress` is told pairs done and pairs in all.
///
/// # Errors
/// [`RecordingError::Input`] names the file that is missing or wrong; others as in writing. Nothing is left then.
pub fn import(
    request: &ImportRequest,
    config: &RecordingConfig,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<ImportSummary, RecordingError> {
    let rig = request.calibration.map(RigFile::read).transpose()?;
    let plan = match request.kind {
        ImportKind::Folder => folder::plan(request.source, rig),
        ImportKind::Hamlyn => hamlyn::plan(request.source, rig),
        ImportKind::Bdis => bdis::plan(request.source, rig),
        ImportKind::Kitti => kitti::plan(request.source, rig),
        ImportKind::Euroc => euroc::plan(request.source, rig),
        ImportKind::D4d => d4d::plan(request.source, rig),
    }?;
    record::record(&plan, request, config, progress)
}

/// Everything to be recorded, frames in the order of their stamps.
struct Plan {
    calibration: Calibration,
    frames: Vec<PlannedFrame>,
}

struct PlannedFrame {
    stamp_ns: u64,
    left: PathBuf,
    right: PathBuf,
    mask: Option<PathBuf>,
    depth: Option<DepthFile>,
    /// Of the rectified left camera.
    world_from_camera: Option<Pose>,
}

impl PlannedFrame {
    /// A frame of which only the images are known.
    fn of_images(stamp_ns: u64, left: PathBuf, right: PathBuf) -> Self {
        Self { stamp_ns, left, right, mask: None, depth: None, world_from_camera: None }
    }
}

/// A file of true depth.
struct DepthFile {
    path: PathBuf,
    encoding: DepthEncoding,
    /// Metres of one unit.
    unit_m: f64,
}

enum DepthEncoding {
    /// A 16-bit grey PNG of units, 0 where unknown.
    Gray16,
    /// A colour PNG: whole units are `round(green * 100 / 255)`, their fraction is `red / 255`.
    RedGreen,
}
