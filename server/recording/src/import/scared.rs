//! SCARED (Allan et al. 2021): a keyframe's folder with `endoscope_calibration.yaml` (millimetres), the still pair
//! `Left_Image.png` and `Right_Image.png` with `left_depth_map.tiff` (points of the left camera, structured light), and in
//! `data/` the clip `rgb.mp4` (left eye above) with `frame_data.tar.gz`: a JSON file for each picture, whose
//! `camera-pose` takes points of the keyframe's left camera to the picture's.
//!
//! The clip is imported where there is one, else the still pair. Depth of the clip (`scene_points.tar.gz`, some 30 MB a
//! picture) is read once it is unpacked into `data/scene_points/`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use geometry::Pose;
use serde::Deserialize;

use super::files::{left_from_rectified, with_extension};
use super::stereo_video::{OpenedVideo, VideoFiles};
use super::{DepthEncoding, DepthFile, Given, Images, Plan, PlannedFrame, files};
use crate::calibration_file::{CalibrationHints, read_calibration};
use crate::rotation::pose_from_rows;
use crate::{RecordingError, RigFile};

const CALIBRATION: &str = "endoscope_calibration.yaml";
const STILLS: [&str; 2] = ["Left_Image.png", "Right_Image.png"];
const VIDEOS: [&str; 2] = ["data/rgb.mp4", "rgb.mp4"];
const MM: f64 = 1e-3;
/// Most bytes of a picture's JSON file that are read.
const JSON_MAX_BYTES: u64 = 1 << 20;

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let frame_rate_hz = given.frame_rate_hz;
    let image_px = Some(files::image_size_px(&source.join(STILLS[0]))?);
    let rig = given
        .rig_or(|| read_calibration(&source.join(CALIBRATION), &CalibrationHints { image_px, unit_m: MM }))?;
    match VIDEOS.into_iter().map(|name| source.join(name)).find(|path| path.is_file()) {
        Some(video) => clip(source, video, &rig, frame_rate_hz),
        None => Ok(stills(source, &rig)),
    }
}

fn stills(source: &Path, rig: &RigFile) -> Plan {
    let path = source.join("left_depth_map.tiff");
    let depth = path.is_file().then(|| point_map(path));
    Plan {
        calibration: rig.calibration,
        frames: vec![PlannedFrame { depth, ..PlannedFrame::at(0) }],
        images: Images::Files(vec![STILLS.map(|name| source.join(name))]),
    }
}

fn clip(
    source: &Path,
    video: PathBuf,
    rig: &RigFile,
    frame_rate_hz: Option<f64>,
) -> Result<Plan, RecordingError> {
    let data = source.join("data");
    let video = OpenedVideo::open(VideoFiles::One(video))?;
    let stamps_ns = video.stamps_ns(frame_rate_hz)?;
    let left_from_rectified = left_from_rectified(&rig.calibration)?;
    let poses = read_poses(&data)?;
    let mut depths = numbered(&data.join("scene_points"), "tiff")?;
    let frames = (0..).zip(&stamps_ns).map(|(number, &stamp_ns)| PlannedFrame {
        depth: depths.remove(&number).map(point_map),
        world_from_camera: poses
            .get(&number)
            .map(|camera_from_world: &Pose| camera_from_world.inverse() * left_from_rectified),
        ..PlannedFrame::at(stamp_ns)
    });
    let frames = frames.collect();
    let images = Images::Video {
        video: video.decode(rig.calibration.image_size_px())?,
        numbers: (0..stamps_ns.len()).collect(),
    };
    Ok(Plan { calibration: rig.calibration, frames, images })
}

fn point_map(path: PathBuf) -> DepthFile {
    DepthFile { path, encoding: DepthEncoding::PointMap, unit_m: MM }
}

/// The files of a folder by the number that their names end with; empty without the folder.
fn numbered(folder: &Path, extension: &str) -> Result<BTreeMap<u64, PathBuf>, RecordingError> {
    if !folder.is_dir() {
        return Ok(BTreeMap::new());
    }
    let paths = with_extension(folder, extension)?;
    Ok(paths.into_iter().filter_map(|path| Some((number(&path)?, path))).collect())
}

fn number(path: &Path) -> Option<u64> {
    files::Stem::new(path.file_stem()?.to_str()?).number()
}

/// The left camera's poses, from the keyframe's, by the picture's number: unpacked or as they come.
fn read_poses(data: &Path) -> Result<BTreeMap<u64, Pose>, RecordingError> {
    let (folder, archive) = (data.join("frame_data"), data.join("frame_data.tar.gz"));
    let mut poses = BTreeMap::new();
    for (number, path) in numbered(&folder, "json")? {
        let text = files::text(&path)?;
        poses.insert(number, parse_pose(&text).map_err(|problem| RecordingError::input(&path, problem))?);
    }
    if !poses.is_empty() || !archive.is_file() {
        return Ok(poses);
    }
    let file = File::open(&archive).map_err(RecordingError::io(&archive))?;
    let refused = |error: std::io::Error| RecordingError::input(&archive, error);
    for entry in tar::Archive::new(GzDecoder::new(file)).entries().map_err(refused)? {
        let entry = entry.map_err(refused)?;
        let name = entry.path().map_err(refused)?.into_owned();
        let is_json = name.extension().is_some_and(|extension| extension == "json");
        let Some(number) = number(&name).filter(|_| is_json) else { continue };
        let mut text = String::new();
        entry.take(JSON_MAX_BYTES).read_to_string(&mut text).map_err(refused)?;
        let pose = parse_pose(&text);
        let named =
            |problem: String| RecordingError::input(&archive, format!("{}: {problem}", name.display()));
        poses.insert(number, pose.map_err(named)?);
    }
    Ok(poses)
}

#[derive(Deserialize)]
struct FrameData {
    #[serde(rename = "camera-pose")]
    camera_pose: [[f64; 4]; 4],
}

/// Takes points of the keyframe's left camera to the picture's; metres.
fn parse_pose(text: &str) -> Result<Pose, String> {
    let data: FrameData = serde_json::from_str(text).map_err(|error| format!("camera-pose: {error}"))?;
    let rows: [f64; 16] = std::array::from_fn(|index| data.camera_pose[index / 4][index % 4]);
    let [rows @ .., _, _, _, _] = rows;
    let mut pose =
        pose_from_rows(&rows).ok_or_else(|| format!("camera-pose = {rows:?} is no rigid motion"))?;
    pose.translation.vector *= MM;
    Ok(pose)
}
