//! Foxglove's messages.

use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};
use prost::Message;
use prost_types::Timestamp;

use geometry::Pose;
use geometry::trajectory::StampedPose;

use super::{DepthMessage, ImageMessage, Malformed};
use crate::TruthPoints;
use crate::calibration::CameraRecord;
use crate::schema::foxglove::packed_element_field::NumericType;
use crate::schema::{self, foxglove};

pub(super) fn compressed_image(data: &[u8], log_time_ns: u64) -> Result<ImageMessage, Malformed> {
    let message: foxglove::CompressedImage = decode(data)?;
    let image = super::compressed_image(&message.format, message.data)?;
    Ok(ImageMessage { stamp_ns: stamp(message.timestamp.as_ref(), log_time_ns)?, image })
}

pub(super) fn raw_image(data: &[u8], log_time_ns: u64) -> Result<ImageMessage, Malformed> {
    let message: foxglove::RawImage = decode(data)?;
    let size = (message.width, message.height);
    let image = super::raw_image(size, &message.encoding, message.step, message.data)?;
    Ok(ImageMessage { stamp_ns: stamp(message.timestamp.as_ref(), log_time_ns)?, image })
}

pub(super) fn camera_calibration(data: &[u8]) -> Result<CameraRecord, Malformed> {
    let message: foxglove::CameraCalibration = decode(data)?;
    Ok(CameraRecord {
        width: message.width,
        height: message.height,
        distortion_model: message.distortion_model,
        k: array("K", &message.k)?,
        // Left out by writers of rectified images.
        r: if message.r.is_empty() { [0.0; 9] } else { array("R", &message.r)? },
        p: array("P", &message.p)?,
        d: message.d,
    })
}

/// A raw image of 32-bit floats in metres.
pub(crate) fn depth(data: &[u8], log_time_ns: u64) -> Result<DepthMessage, Malformed> {
    let message: foxglove::RawImage = decode(data)?;
    if message.encoding != "32FC1" {
        return Err(Malformed::new("encoding", format!("{:?} is not 32FC1", message.encoding)));
    }
    let row_bytes = u64::from(message.width) * 4;
    let (step, height) = (u64::from(message.step), u64::from(message.height));
    if row_bytes == 0 || height == 0 || step < row_bytes {
        let problem = format!("{step} bytes for {} columns, {height} rows", message.width);
        return Err(Malformed::new("step", problem));
    }
    if (message.data.len() as u64) < step * (height - 1) + row_bytes {
        let problem = format!("{} bytes do not hold {height} rows of {step}", message.data.len());
        return Err(Malformed::new("data", problem));
    }
    let rows = message.data.chunks(step as usize).take(height as usize);
    let depth_m = rows
        .flat_map(|row| &row.as_chunks::<4>().0[..message.width as usize])
        .map(|&bytes| f32::from_le_bytes(bytes))
        .collect();
    let stamp_ns = stamp(message.timestamp.as_ref(), log_time_ns)?;
    Ok(DepthMessage { stamp_ns, width: message.width, height: message.height, depth_m })
}

pub(crate) fn pose(data: &[u8], log_time_ns: u64) -> Result<StampedPose, Malformed> {
    let message: foxglove::PoseInFrame = decode(data)?;
    let stamp_ns = stamp(message.timestamp.as_ref(), log_time_ns)?;
    let pose = message.pose.ok_or_else(|| Malformed::new("pose", "missing"))?;
    let world_from_camera = rigid(&pose)?;
    Ok(StampedPose { stamp_ns, world_from_camera })
}

fn rigid(pose: &foxglove::Pose) -> Result<Pose, Malformed> {
    let t = pose.position.unwrap_or_default();
    let q = pose.orientation.ok_or_else(|| Malformed::new("pose.orientation", "missing"))?;
    let quaternion = Quaternion::new(q.w, q.x, q.y, q.z);
    let norm = quaternion.norm();
    if !norm.is_finite() || norm < f64::EPSILON {
        let problem = format!("({}, {}, {}, {}) is no rotation", q.x, q.y, q.z, q.w);
        return Err(Malformed::new("pose.orientation", problem));
    }
    if [t.x, t.y, t.z].iter().any(|value| !value.is_finite()) {
        let problem = format!("({}, {}, {}) is not finite", t.x, t.y, t.z);
        return Err(Malformed::new("pose.position", problem));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(Pose::from_parts(Translation3::new(t.x, t.y, t.z), rotation))
}

/// Points with `x y z` as f32 or f64 and `id` as u32, wherever the message's fields say they lie.
pub(crate) fn point_cloud(data: &[u8], log_time_ns: u64) -> Result<TruthPoints, Malformed> {
    let message: foxglove::PointCloud = decode(data)?;
    let stride = message.point_stride as usize;
    if stride == 0 || !message.data.len().is_multiple_of(stride) {
        let problem = format!("{stride} does not divide the {} bytes of data", message.data.len());
        return Err(Malformed::new("point_stride", problem));
    }
    let [x, y, z] = ["x", "y", "z"].map(|name| coordinate(&message, name));
    let (x, y, z, id) = (x?, y?, z?, field(&message, "id", &[NumericType::Uint32])?);
    let points = message.data.chunks_exact(stride);
    Ok(TruthPoints {
        stamp_ns: stamp(message.timestamp.as_ref(), log_time_ns)?,
        ids: points.clone().map(|point| u32::from_le_bytes(bytes_at(point, id.0))).collect(),
        points_in_world: points.map(|p| Point3::new(number(p, x), number(p, y), number(p, z))).collect(),
    })
}

/// Where in a point a field lies, and its type.
type Field = (usize, NumericType);

fn coordinate(message: &foxglove::PointCloud, name: &str) -> Result<Field, Malformed> {
    field(message, name, &[NumericType::Float32, NumericType::Float64])
}

fn field(message: &foxglove::PointCloud, name: &str, allowed: &[NumericType]) -> Result<Field, Malformed> {
    let label = format!("fields.{name}");
    let found = message.fields.iter().find(|field| field.name == name);
    let field = found.ok_or_else(|| Malformed::new(&label, "missing"))?;
    if !allowed.contains(&field.r#type()) {
        return Err(Malformed::new(&label, format!("type {} is not one of {allowed:?}", field.r#type)));
    }
    let bytes = if field.r#type() == NumericType::Float64 { 8 } else { 4 };
    if u64::from(field.offset) + bytes > u64::from(message.point_stride) {
        let problem = format!("offset {} is outside the stride of {}", field.offset, message.point_stride);
        return Err(Malformed::new(&label, problem));
    }
    Ok((field.offset as usize, field.r#type()))
}

fn number(point: &[u8], (offset, kind): Field) -> f64 {
    match kind {
        NumericType::Float64 => f64::from_le_bytes(bytes_at(point, offset)),
        _ => f64::from(f32::from_le_bytes(bytes_at(point, offset))),
    }
}

fn bytes_at<const N: usize>(point: &[u8], offset: usize) -> [u8; N] {
    *point[offset..].first_chunk().expect("the field was checked to lie inside the point")
}

fn decode<M: Message + Default>(data: &[u8]) -> Result<M, Malformed> {
    M::decode(data).map_err(|error| Malformed::new("message", error))
}

fn array<const N: usize>(field: &str, values: &[f64]) -> Result<[f64; N], Malformed> {
    values.try_into().map_err(|_| Malformed::new(field, format!("{} values, not {N}", values.len())))
}

fn stamp(time: Option<&Timestamp>, log_time_ns: u64) -> Result<u64, Malformed> {
    let Some(time) = time else { return Ok(log_time_ns) };
    schema::stamp_ns(time).ok_or_else(|| {
        Malformed::new("timestamp", format!("{} s {} ns is no time since 1970", time.seconds, time.nanos))
    })
}
