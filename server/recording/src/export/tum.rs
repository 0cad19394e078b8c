//! Trajectories as text: `t tx ty tz qx qy qz qw` a line, seconds and metres, `world_from_camera`.
//!
//! Stamps are printed and parsed as integers: the nearest `f64` of a nanosecond stamp is off by up to 128 ns.

use std::fmt::Write;
use std::path::Path;

use geometry::Pose;
use geometry::trajectory::StampedPose;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use crate::RecordingError;

const NS_PER_S: u64 = 1_000_000_000;
const NS_DIGITS: usize = 9;

/// Writes a trajectory; the quaternion's real part is never negative.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_tum(path: &Path, poses: &[StampedPose]) -> Result<(), RecordingError> {
    std::fs::write(path, tum_text(poses)).map_err(RecordingError::io(path))
}

/// The text of such a file.
pub fn tum_text<'a>(poses: impl IntoIterator<Item = &'a StampedPose>) -> String {
    let mut text = String::from("# t tx ty tz qx qy qz qw\n");
    for StampedPose { stamp_ns, world_from_camera } in poses {
        let t = &world_from_camera.translation.vector;
        let q = world_from_camera.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        let [qx, qy, qz, qw] = [q.i, q.j, q.k, q.w].map(|value| value * sign);
        let (s, ns) = (stamp_ns / NS_PER_S, stamp_ns % NS_PER_S);
        writeln!(text, "{s}.{ns:09} {:.9} {:.9} {:.9} {qx:.9} {qy:.9} {qz:.9} {qw:.9}", t.x, t.y, t.z)
            .expect("a string takes what is written");
    }
    text
}

/// Reads a trajectory; empty lines and what follows `#` are skipped.
///
/// # Errors
/// [`RecordingError::Io`], or [`RecordingError::Input`] naming the line.
pub fn read_tum(path: &Path) -> Result<Vec<StampedPose>, RecordingError> {
    let text = std::fs::read_to_string(path).map_err(RecordingError::io(path))?;
    let mut poses = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if !content.is_empty() {
            let pose = parse_line(content);
            poses.push(
                pose.map_err(|problem| {
                    RecordingError::input(path, format!("line {}: {problem}", index + 1))
                })?,
            );
        }
    }
    Ok(poses)
}

fn parse_line(line: &str) -> Result<StampedPose, String> {
    let mut words = line.split_whitespace();
    let stamp = words.next().ok_or("no stamp")?;
    let stamp_ns = parse_stamp_ns(stamp).ok_or_else(|| format!("{stamp:?} is no time in seconds"))?;
    let mut values = [0.0; 7];
    for (value, name) in values.iter_mut().zip(["tx", "ty", "tz", "qx", "qy", "qz", "qw"]) {
        let word = words.next().ok_or_else(|| format!("{name} is missing"))?;
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        *value = number.ok_or_else(|| format!("{name} = {word:?}"))?;
    }
    let [tx, ty, tz, qx, qy, qz, qw] = values;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    if quaternion.norm() < f64::EPSILON {
        return Err("the quaternion is zero".into());
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(StampedPose { stamp_ns, world_from_camera: Pose::from_parts(Translation3::new(tx, ty, tz), rotation) })
}

/// Nanoseconds of decimal seconds, cut after the ninth digit.
fn parse_stamp_ns(text: &str) -> Option<u64> {
    let (seconds, fraction) = text.split_once('.').unwrap_or((text, ""));
    if !fraction.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let digits = &fraction[..fraction.len().min(NS_DIGITS)];
    let nanos: u64 = format!("{digits:0<NS_DIGITS$}").parse().ok()?;
    seconds.parse::<u64>().ok()?.checked_mul(NS_PER_S)?.checked_add(nanos)
}
