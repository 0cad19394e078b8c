//! Data sets of images and calibration files to recordings.
//!
//! Each importer is a function from a folder to a [`Plan`]: which files make a frame, when it was, what is known of
//! it. One function, [`import`], records any plan; images are copied as the bytes they are, those of videos are encoded.
//! A ROS 2 bag is a recording already; its pairs are copied.

mod bdis;
mod d4d;
mod endonerf;
mod euroc;
mod ffmpeg;
mod files;
mod folder;
mod hamlyn;
mod kitti;
mod opencv_yaml;
mod point_map;
mod record;
mod ros2bag;
mod scared;
mod servct;
mod stereo_video;
mod stereomis;
mod video;

use std::fmt::{Display, Formatter};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use geometry::Pose;

use crate::calibration_file::{CalibrationHints, read_calibration};
use crate::{Calibration, RecordingConfig, RecordingError, RigFile, Topics};
use stereo_video::StereoVideo;

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
    /// SCARED: a keyframe's folder, its clip or its still pair.
    Scared,
    /// StereoMIS: a sequence's folder with one video.
    Stereomis,
    /// SERV-CT: an experiment's folder, or one left image of it.
    Servct,
    /// EndoNeRF: `images/`, `images_right/`, `masks/`, `poses_bounds.npy`.
    Endonerf,
    /// A ROS 2 bag: its folder, or an MCAP file.
    Ros2bag,
    /// A stereo video: side by side, top and bottom, or a file for each eye.
    Video,
}

impl ImportKind {
    /// Every kind.
    pub const ALL: [Self; 12] = [
        Self::Folder,
        Self::Hamlyn,
        Self::Bdis,
        Self::Kitti,
        Self::Euroc,
        Self::D4d,
        Self::Scared,
        Self::Stereomis,
        Self::Servct,
        Self::Endonerf,
        Self::Ros2bag,
        Self::Video,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Folder => "folder",
            Self::Hamlyn => "hamlyn",
            Self::Bdis => "bdis",
            Self::Kitti => "kitti",
            Self::Euroc => "euroc",
            Self::D4d => "d4d",
            Self::Scared => "scared",
            Self::Stereomis => "stereomis",
            Self::Servct => "servct",
            Self::Endonerf => "endonerf",
            Self::Ros2bag => "ros2bag",
            Self::Video => "video",
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
    /// Its folder or file.
    pub source: &'a Path,
    /// A calibration of any kind that [`read_calibration`] reads, in place of the data set's own.
    pub calibration: Option<&'a Path>,
    /// Metres for each unit of a calibration that does not tell its own.
    pub calibration_unit_m: f64,
    /// Images a second, in place of the data set's own times or rate.
    pub frame_rate_hz: Option<f64>,
    /// Topics of a bag; those that the recording gets where `None`.
    pub bag_topics: Option<&'a Topics>,
    /// The recording to write; it appears once it is complete.
    pub recording: &'a Path,
}

impl<'a> ImportRequest<'a> {
    /// An import that says nothing in place of the data set; calibrations without a unit are in millimetres.
    pub fn new(kind: ImportKind, source: &'a Path, recording: &'a Path) -> Self {
        let calibration_unit_m = 1e-3;
        Self {
            kind,
            source,
            calibration: None,
            calibration_unit_m,
            frame_rate_hz: None,
            bag_topics: None,
            recording,
        }
    }
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
    let given = Given::of(request)?;
    check_frame_rate(request)?;
    let plan = match request.kind {
        ImportKind::Folder => folder::plan(request.source, given),
        ImportKind::Hamlyn => hamlyn::plan(request.source, given),
        ImportKind::Bdis => bdis::plan(request.source, given),
        ImportKind::Kitti => kitti::plan(request.source, given),
        ImportKind::Euroc => euroc::plan(request.source, given),
        ImportKind::D4d => d4d::plan(request.source, given),
        ImportKind::Scared => scared::plan(request.source, given),
        ImportKind::Stereomis => stereomis::plan(request.source, given),
        ImportKind::Servct => servct::plan(request.source, given),
        ImportKind::Endonerf => endonerf::plan(request.source, given),
        ImportKind::Video => video::plan(request.source, given),
        ImportKind::Ros2bag => return ros2bag::import(request, given, config, progress),
    }?;
    record::record(plan, request, config, progress)
}

/// Where each pair has a time of its own that the true poses go by too, a rate would tear the two apart.
fn check_frame_rate(request: &ImportRequest) -> Result<(), RecordingError> {
    let has_stamps = matches!(request.kind, ImportKind::Euroc | ImportKind::Ros2bag);
    if has_stamps && request.frame_rate_hz.is_some() {
        let problem =
            format!("{} has a stamp for each pair; a frame rate cannot take their place", request.kind);
        return Err(RecordingError::input(request.source, problem));
    }
    Ok(())
}

/// What the user says in place of the data set.
struct Given {
    rig: Option<RigFile>,
    frame_rate_hz: Option<f64>,
}

impl Given {
    fn of(request: &ImportRequest) -> Result<Self, RecordingError> {
        if let Some(rate_hz) =
            request.frame_rate_hz.filter(|rate_hz| !(rate_hz.is_finite() && *rate_hz > 0.0))
        {
            let problem = format!("a frame rate of {rate_hz} Hz; it must be above 0");
            return Err(RecordingError::input(request.source, problem));
        }
        let read = |path| {
            let image_px = files::any_image_size_px(request.source);
            read_calibration(path, &CalibrationHints { image_px, unit_m: request.calibration_unit_m })
        };
        let rig = request.calibration.map(read).transpose()?;
        Ok(Self { rig, frame_rate_hz: request.frame_rate_hz })
    }

    /// The rig that is given, or else the data set's own, at the rate that is given.
    fn rig_or(
        self,
        own: impl FnOnce() -> Result<RigFile, RecordingError>,
    ) -> Result<RigFile, RecordingError> {
        let rig = self.rig.map_or_else(own, Ok)?;
        Ok(RigFile { frame_rate_hz: self.frame_rate_hz.or(rig.frame_rate_hz), ..rig })
    }
}

/// Everything to be recorded, frames in the order of their stamps.
struct Plan {
    calibration: Calibration,
    frames: Vec<PlannedFrame>,
    images: Images,
}

/// Where the images of the frames are, in the frames' order.
enum Images {
    /// Left and right files.
    Files(Vec<[PathBuf; 2]>),
    /// Pictures of a video, by their numbers.
    Video { video: StereoVideo, numbers: Vec<usize> },
}

impl Images {
    fn of_pairs<K>(pairs: Vec<(K, PathBuf, PathBuf)>) -> Self {
        Self::Files(pairs.into_iter().map(|(_, left, right)| [left, right]).collect())
    }
}

struct PlannedFrame {
    stamp_ns: u64,
    mask: Option<MaskFile>,
    depth: Option<DepthFile>,
    /// Of the rectified left camera.
    world_from_camera: Option<Pose>,
}

impl PlannedFrame {
    /// A frame of which only the images are known.
    fn at(stamp_ns: u64) -> Self {
        Self { stamp_ns, mask: None, depth: None, world_from_camera: None }
    }
}

/// An image file that covers instruments.
struct MaskFile {
    path: PathBuf,
    meaning: MaskMeaning,
}

enum MaskMeaning {
    /// As in recordings.
    InstrumentIsBright,
    /// The other way round, and of any size.
    TissueIsBright,
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
    /// A TIFF of 32-bit floats, the point that each pixel of the left camera shows, in that camera's frame; not finite or
    /// 0 where unknown. May have the right camera's below.
    PointMap,
}
