//! The `sensor_msgs` of ROS 2, in the order of their `.msg` files.

use super::cdr::CdrReader;
use super::{ImageMessage, Malformed};
use crate::calibration::CameraRecord;
use crate::schema::stamp_from_parts;

pub(super) fn image(data: &[u8]) -> Result<ImageMessage, Malformed> {
    let mut reader = CdrReader::new(data)?;
    let stamp_ns = header(&mut reader)?;
    let height = reader.u32("height")?;
    let width = reader.u32("width")?;
    let encoding = reader.string("encoding")?;
    let _is_bigendian = reader.u8("is_bigendian")?;
    let row_bytes = reader.u32("step")?;
    let bytes = reader.bytes("data")?.to_vec();
    Ok(ImageMessage { stamp_ns, image: super::raw_image((width, height), &encoding, row_bytes, bytes)? })
}

pub(super) fn compressed_image(data: &[u8]) -> Result<ImageMessage, Malformed> {
    let mut reader = CdrReader::new(data)?;
    let stamp_ns = header(&mut reader)?;
    let format = reader.string("format")?;
    let bytes = reader.bytes("data")?.to_vec();
    Ok(ImageMessage { stamp_ns, image: super::compressed_image(&format, bytes)? })
}

/// A `CameraInfo`; binning and region of interest, which follow, are not read.
pub(super) fn camera_info(data: &[u8]) -> Result<CameraRecord, Malformed> {
    let mut reader = CdrReader::new(data)?;
    header(&mut reader)?;
    let height = reader.u32("height")?;
    let width = reader.u32("width")?;
    Ok(CameraRecord {
        width,
        height,
        distortion_model: reader.string("distortion_model")?,
        d: reader.f64_sequence("d")?,
        k: reader.f64_array("k")?,
        r: reader.f64_array("r")?,
        p: reader.f64_array("p")?,
    })
}

/// Reads a `std_msgs/Header`; gives its stamp.
fn header(reader: &mut CdrReader) -> Result<u64, Malformed> {
    let seconds = reader.i32("header.stamp.sec")?;
    let nanos = reader.u32("header.stamp.nanosec")?;
    let _frame_id = reader.string("header.frame_id")?;
    stamp_from_parts(i64::from(seconds), u64::from(nanos)).ok_or_else(|| {
        Malformed::new("header.stamp", format!("{seconds} s {nanos} ns is no time since 1970"))
    })
}
