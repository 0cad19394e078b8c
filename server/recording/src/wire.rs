//! Messages as they lie in the file, decoded to plain structs: Foxglove's protobuf and ROS 2's CDR.

mod cdr;
mod protobuf;
mod ros2;

use crate::EncodedImage;
use crate::calibration::CameraRecord;

/// An image message of any kind.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ImageMessage {
    pub stamp_ns: u64,
    pub image: EncodedImage,
}

/// A raw image of `f32` depth in metres.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DepthMessage {
    pub stamp_ns: u64,
    pub width: u32,
    pub height: u32,
    pub depth_m: Vec<f32>,
}

/// A message's field that makes no sense.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Malformed {
    pub field: String,
    pub problem: String,
}

impl Malformed {
    pub fn new(field: &str, problem: impl std::fmt::Display) -> Self {
        Self { field: field.to_owned(), problem: problem.to_string() }
    }
}

/// The kinds of message that are read, of either family.
enum Kind {
    FoxgloveCompressedImage,
    FoxgloveRawImage,
    FoxgloveCameraCalibration,
    RosImage,
    RosCompressedImage,
    RosCameraInfo,
    Other(String),
}

fn kind(channel: &mcap::Channel) -> Kind {
    let schema = channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
    match (channel.message_encoding.as_str(), schema) {
        ("protobuf", "foxglove.CompressedImage") => Kind::FoxgloveCompressedImage,
        ("protobuf", "foxglove.RawImage") => Kind::FoxgloveRawImage,
        ("protobuf", "foxglove.CameraCalibration") => Kind::FoxgloveCameraCalibration,
        ("cdr", "sensor_msgs/msg/Image") => Kind::RosImage,
        ("cdr", "sensor_msgs/msg/CompressedImage") => Kind::RosCompressedImage,
        ("cdr", "sensor_msgs/msg/CameraInfo") => Kind::RosCameraInfo,
        (encoding, schema) => Kind::Other(format!("{schema:?} in {encoding:?}")),
    }
}

/// Decodes an image message; `log_time_ns` stands in for a stamp that was left out.
pub(crate) fn image(
    channel: &mcap::Channel,
    log_time_ns: u64,
    data: &[u8],
) -> Result<ImageMessage, Malformed> {
    match kind(channel) {
        Kind::FoxgloveCompressedImage => protobuf::compressed_image(data, log_time_ns),
        Kind::FoxgloveRawImage => protobuf::raw_image(data, log_time_ns),
        Kind::RosImage => ros2::image(data),
        Kind::RosCompressedImage => ros2::compressed_image(data),
        Kind::FoxgloveCameraCalibration | Kind::RosCameraInfo => {
            Err(Malformed::new("schema", "a calibration where an image is expected"))
        }
        Kind::Other(schema) => Err(unread(&schema, "images")),
    }
}

/// Decodes a calibration message.
pub(crate) fn calibration(channel: &mcap::Channel, data: &[u8]) -> Result<CameraRecord, Malformed> {
    match kind(channel) {
        Kind::FoxgloveCameraCalibration => protobuf::camera_calibration(data),
        Kind::RosCameraInfo => ros2::camera_info(data),
        Kind::Other(schema) => Err(unread(&schema, "calibrations")),
        _ => Err(Malformed::new("schema", "an image where a calibration is expected")),
    }
}

pub(crate) use protobuf::{depth, point_cloud, pose};

fn unread(schema: &str, what: &str) -> Malformed {
    Malformed::new("schema", format!("{schema} is not read; {what} of Foxglove protobuf and ROS 2 cdr are"))
}

/// The raw image of a message's size, encoding and rows, once they are known to fit.
fn raw_image(
    (width, height): (u32, u32),
    encoding: &str,
    row_bytes: u32,
    bytes: Vec<u8>,
) -> Result<EncodedImage, Malformed> {
    let pixel = crate::RawPixel::from_name(encoding).ok_or_else(|| {
        Malformed::new("encoding", format!("{encoding:?} is not read; rgb8, bgr8 and mono8 are"))
    })?;
    Ok(EncodedImage { format: crate::ImageFormat::Raw { width, height, row_bytes, pixel }, bytes })
}

/// The compressed image of a message's format and bytes.
fn compressed_image(format: &str, bytes: Vec<u8>) -> Result<EncodedImage, Malformed> {
    let known = crate::ImageFormat::from_description(format);
    let format =
        known.ok_or_else(|| Malformed::new("format", format!("{format:?} is not read; jpeg and png are")))?;
    Ok(EncodedImage { format, bytes })
}
