//! `StereoCalibration.ini` of StereoMIS: sections `StereoLeft` and `StereoRight` with `res_x res_y fc_x fc_y cc_x cc_y`,
//! lens coefficients `kc_0..` in OpenCV's order, and in the right one `R_0..R_8` and `T_0..T_2` (millimetres), which take
//! points of the left camera to it.

use std::path::Path;

use geometry::CameraModel;
use ini::{Ini, Properties};

use super::numbers::side_px;
use super::stereo::{self, CameraNumbers};
use crate::{Calibration, RecordingError};

const MM: f64 = 1e-3;
const LENS_MAX: usize = 14;

pub(super) fn read(path: &Path) -> Result<Calibration, RecordingError> {
    let text = std::fs::read_to_string(path).map_err(RecordingError::io(path))?;
    let file = Ini::load_from_str(&text).map_err(|error| RecordingError::input(path, error))?;
    parse(&file).map_err(|problem| RecordingError::input(path, problem))
}

fn parse(file: &Ini) -> Result<Calibration, String> {
    let section = |name: &'static str| {
        let found = file.section(Some(name)).ok_or_else(|| format!("section [{name}] is missing"))?;
        Ok::<_, String>(Section { name, values: found })
    };
    let (left, right) = (section("StereoLeft")?, section("StereoRight")?);
    let (rotation, translation) = (right.list("R", 9)?, right.list("T", 3)?);
    let right_from_left =
        stereo::right_from_left(["StereoRight: R", "StereoRight: T"], &rotation, &translation, MM)?;
    stereo::rig(left.camera()?, right.camera()?, right_from_left)
}

struct Section<'a> {
    name: &'static str,
    values: &'a Properties,
}

impl Section<'_> {
    /// A number whose key may be in either case; `None` without the key.
    fn optional(&self, key: &str) -> Result<Option<f64>, String> {
        let lower = key.to_ascii_lowercase();
        let Some(text) = self.values.get(key).or_else(|| self.values.get(&lower)) else { return Ok(None) };
        let number = text.trim().parse();
        number.map(Some).map_err(|_| format!("{}: {key} = {text:?} is no number", self.name))
    }

    fn number(&self, key: &str) -> Result<f64, String> {
        self.optional(key)?.ok_or_else(|| format!("{}: {key} is missing", self.name))
    }

    fn list(&self, stem: &str, count: usize) -> Result<Vec<f64>, String> {
        (0..count).map(|index| self.number(&format!("{stem}_{index}"))).collect()
    }

    fn camera(&self) -> Result<CameraModel, String> {
        let name = self.name;
        let side = |key: &str| side_px(&format!("{name}: {key}"), self.number(key)?);
        let mut lens = Vec::new();
        while let Some(value) = self.optional(&format!("kc_{}", lens.len()))? {
            lens.push(value);
            if lens.len() > LENS_MAX {
                return Err(format!("{name}: kc has more than {LENS_MAX} coefficients"));
            }
        }
        let [fx, fy, cx, cy] = ["fc_x", "fc_y", "cc_x", "cc_y"].map(|key| self.number(key));
        let intrinsic = [fx?, 0.0, cx?, 0.0, fy?, cy?, 0.0, 0.0, 1.0];
        stereo::camera(&CameraNumbers {
            size_px: (side("res_x")?, side("res_y")?),
            intrinsic: (&format!("{name}: fc, cc"), intrinsic),
            distortion: (&format!("{name}: kc"), &lens),
        })
    }
}
