//! Kalibr's `camchain.yaml`: `cam0` and `cam1` with intrinsics, and `T_cn_cnm1` of `cam1`, which takes points of `cam0`
//! to it, in metres. `cam0` is the left eye.

use geometry::CameraModel;
use yaml_rust2::Yaml;

use super::numbers::{exactly, side_px};
use super::stereo::{self, CameraNumbers};
use super::yaml;
use crate::Calibration;
use crate::rotation::pose_from_rows;

pub(super) fn parse(document: &Yaml) -> Result<Calibration, String> {
    let of = |camera: &'static str| move |problem: String| format!("{camera}: {problem}");
    let (left, right) = (&document["cam0"], &document["cam1"]);
    if !yaml::has(document, "cam1") {
        return Err("cam1 is missing: a stereo rig has two cameras".into());
    }
    let rows = yaml::numbers(right, "T_cn_cnm1").map_err(of("cam1"))?;
    let [rows @ .., _, _, _, _] = exactly::<16>("cam1: T_cn_cnm1", &rows)?;
    let motion =
        pose_from_rows(&rows).ok_or_else(|| format!("cam1: T_cn_cnm1 = {rows:?} is no rigid motion"))?;
    let right_from_left =
        stereo::motion("cam1: T_cn_cnm1", motion.rotation, motion.translation.vector.into())?;
    stereo::rig(camera(left).map_err(of("cam0"))?, camera(right).map_err(of("cam1"))?, right_from_left)
}

fn camera(table: &Yaml) -> Result<CameraModel, String> {
    for (key, known) in [("camera_model", "pinhole"), ("distortion_model", "radtan")] {
        let model = table[key].as_str().unwrap_or_default();
        let is_none = key == "distortion_model" && model == "none";
        if model != known && !is_none {
            return Err(format!("{key}: {model:?} is not read; {known} is"));
        }
    }
    let [width, height] = yaml::array(table, "resolution")?;
    let [fx, fy, cx, cy] = yaml::array(table, "intrinsics")?;
    let lens = yaml::numbers(table, "distortion_coeffs")?;
    stereo::camera(&CameraNumbers {
        size_px: (side_px("resolution", width)?, side_px("resolution", height)?),
        intrinsic: ("intrinsics", [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        distortion: ("distortion_coeffs", &lens),
    })
}
