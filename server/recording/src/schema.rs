//! The message types of recordings, generated from `proto/`, and the descriptor sets written beside them.

use prost::Message;
use prost_types::Timestamp;

#[allow(clippy::all, clippy::doc_markdown)]
pub(crate) mod foxglove {
    include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
}

#[allow(clippy::all, clippy::doc_markdown)]
pub(crate) mod model {
    include!(concat!(env!("OUT_DIR"), "/mis_slam.recording.v1.rs"));
}

const NS_PER_S: u64 = 1_000_000_000;

/// A message that recordings carry.
pub(crate) trait Schema: Message + Default {
    /// Full protobuf name.
    const NAME: &'static str;
    /// Serialized `FileDescriptorSet` with everything that the message refers to.
    const DESCRIPTORS: &'static [u8];
}

macro_rules! schema {
    ($message:ty, $name:literal) => {
        impl Schema for $message {
            const NAME: &'static str = $name;
            const DESCRIPTORS: &'static [u8] = include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".binpb"));
        }
    };
}

schema!(foxglove::CameraCalibration, "foxglove.CameraCalibration");
schema!(foxglove::CompressedImage, "foxglove.CompressedImage");
schema!(foxglove::PointCloud, "foxglove.PointCloud");
schema!(foxglove::PoseInFrame, "foxglove.PoseInFrame");
schema!(foxglove::RawImage, "foxglove.RawImage");
schema!(model::SurfelModel, "mis_slam.recording.v1.SurfelModel");

/// The protobuf time of a stamp.
pub(crate) fn timestamp(stamp_ns: u64) -> Option<Timestamp> {
    let seconds = (stamp_ns / NS_PER_S) as i64;
    Some(Timestamp { seconds, nanos: (stamp_ns % NS_PER_S) as i32 })
}

/// The stamp of a protobuf time; `None` before 1970 or out of range.
pub(crate) fn stamp_ns(time: &Timestamp) -> Option<u64> {
    stamp_from_parts(time.seconds, u64::try_from(time.nanos).ok()?)
}

/// The stamp of seconds and nanoseconds; `None` before 1970 or out of range.
pub(crate) fn stamp_from_parts(seconds: i64, nanos: u64) -> Option<u64> {
    u64::try_from(seconds).ok()?.checked_mul(NS_PER_S)?.checked_add(nanos)
}
