//! Writing recordings.
//!
//! Chunks are built in memory and written whole; after each second of stamps the file is handed to the operating
//! system, so that a killed process loses no more than that, and what is there can be read.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use geometry::{DepthMap, Pose};
use mcap::records::MessageHeader;
use mcap::{Attachment, WriteOptions, Writer};

use crate::calibration::{self, Calibration, CameraRecord};
use crate::export::PlySurfel;
use crate::schema::{Schema, foxglove, model, timestamp};
use crate::truth::TruthPoints;
use crate::{Compression, EncodedImage, ImageFormat, RecordingConfig, RecordingError, Topics};

const MIB: u64 = 1 << 20;
const NS_PER_MS: u64 = 1_000_000;
const WORLD: &str = "world";
const LEFT_FRAME: &str = "stereo_left";
const RIGHT_FRAME: &str = "stereo_right";

/// A recording being written. Dropping it closes the file as [`Self::finish`] does, but tells no error.
pub struct RecordingWriter {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    topics: Topics,
    channels: BTreeMap<String, OpenChannel>,
    flush_interval_ns: u64,
    flushed_ns: Option<u64>,
}

#[derive(Clone, Copy)]
struct OpenChannel {
    id: u16,
    messages: u32,
}

impl RecordingWriter {
    /// Creates the file, or empties it.
    ///
    /// # Errors
    /// [`RecordingError::Io`] or [`RecordingError::Container`].
    pub fn create(path: &Path, config: &RecordingConfig) -> Result<Self, RecordingError> {
        let file = File::create(path).map_err(RecordingError::io(path))?;
        let compression = match config.compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        };
        let writer = WriteOptions::new()
            .compression(compression)
            .compression_level(config.compression_level)
            .compression_threads(0)
            .chunk_size(Some(u64::from(config.chunk_mib) * MIB))
            .disable_seeking(true)
            .library(concat!("mis-slam/", env!("CARGO_PKG_VERSION")))
            .create(BufWriter::new(file))
            .map_err(RecordingError::container(path))?;
        Ok(Self {
            path: path.to_path_buf(),
            writer,
            topics: config.topics.clone(),
            channels: BTreeMap::new(),
            flush_interval_ns: config.flush_interval_ms.saturating_mul(NS_PER_MS),
            flushed_ns: None,
        })
    }

    /// Writes the calibration of both cameras.
    ///
    /// # Errors
    /// [`RecordingError::Calibration`] where a raw calibration cannot be rectified; [`RecordingError::Container`].
    pub fn write_calibration(
        &mut self,
        stamp_ns: u64,
        calibration: &Calibration,
    ) -> Result<(), RecordingError> {
        let [left, right] = calibration::to_records(calibration)?;
        let topics = [self.topics.left_calibration.clone(), self.topics.right_calibration.clone()];
        for (topic, frame, record) in [(&topics[0], LEFT_FRAME, left), (&topics[1], RIGHT_FRAME, right)] {
            self.write(topic, stamp_ns, &calibration_message(stamp_ns, frame, record))?;
        }
        Ok(())
    }

    /// Writes the images of one moment, as they are.
    ///
    /// # Errors
    /// [`RecordingError::Container`], as when the disk is full.
    pub fn write_pair(
        &mut self,
        stamp_ns: u64,
        left: &EncodedImage,
        right: &EncodedImage,
    ) -> Result<(), RecordingError> {
        let topics = [self.topics.left_image.clone(), self.topics.right_image.clone()];
        self.write_image(&topics[0], stamp_ns, LEFT_FRAME, left)?;
        self.write_image(&topics[1], stamp_ns, RIGHT_FRAME, right)
    }

    /// Writes the instrument mask of a left image.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_mask(&mut self, stamp_ns: u64, mask: &EncodedImage) -> Result<(), RecordingError> {
        let topic = self.topics.left_mask.clone();
        self.write_image(&topic, stamp_ns, LEFT_FRAME, mask)
    }

    /// Writes a true pose, of the rectified left camera.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_truth_pose(&mut self, pose: &StampedPose) -> Result<(), RecordingError> {
        let topic = self.topics.truth_pose.clone();
        self.write(&topic, pose.stamp_ns, &pose_message(pose))
    }

    /// Writes the true depth of the left rectified view.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_truth_depth(&mut self, stamp_ns: u64, depth: &DepthMap) -> Result<(), RecordingError> {
        let topic = self.topics.truth_depth.clone();
        let message = foxglove::RawImage {
            timestamp: timestamp(stamp_ns),
            frame_id: LEFT_FRAME.into(),
            width: depth.width(),
            height: depth.height(),
            encoding: "32FC1".into(),
            step: depth.width() * 4,
            data: depth.pixels().iter().flat_map(|z| z.to_le_bytes()).collect(),
        };
        self.write(&topic, stamp_ns, &message)
    }

    /// Writes the true places of material points, rounded to `f32`.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_truth_points(&mut self, points: &TruthPoints) -> Result<(), RecordingError> {
        let topic = self.topics.truth_points.clone();
        self.write(&topic, points.stamp_ns, &points_message(points))
    }

    /// Writes an estimated pose.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_pose(&mut self, pose: &StampedPose) -> Result<(), RecordingError> {
        let topic = self.topics.pose.clone();
        self.write(&topic, pose.stamp_ns, &pose_message(pose))
    }

    /// Writes the estimated model.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_model(&mut self, stamp_ns: u64, surfels: &[PlySurfel]) -> Result<(), RecordingError> {
        let topic = self.topics.model.clone();
        let message = model::SurfelModel {
            timestamp: timestamp(stamp_ns),
            frame_id: WORLD.into(),
            count: surfels.len() as u32,
            surfels: surfels.iter().copied().flat_map(PlySurfel::to_le_bytes).collect(),
        };
        self.write(&topic, stamp_ns, &message)
    }

    /// Attaches a file.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn attach(
        &mut self,
        stamp_ns: u64,
        name: &str,
        media_type: &str,
        bytes: &[u8],
    ) -> Result<(), RecordingError> {
        let attachment = Attachment {
            log_time: stamp_ns,
            create_time: stamp_ns,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: bytes.into(),
        };
        self.writer.attach(&attachment).map_err(RecordingError::container(&self.path))
    }

    /// Writes a named group of keys and values.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn write_metadata(
        &mut self,
        name: &str,
        values: BTreeMap<String, String>,
    ) -> Result<(), RecordingError> {
        let group = mcap::records::Metadata { name: name.to_owned(), metadata: values };
        self.writer.write_metadata(&group).map_err(RecordingError::container(&self.path))
    }

    /// Hands everything so far to the operating system.
    ///
    /// # Errors
    /// [`RecordingError::Container`].
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.writer.flush().map_err(RecordingError::container(&self.path))
    }

    /// Writes the index, closes the file and has the disk keep it.
    ///
    /// # Errors
    /// [`RecordingError::Container`] or [`RecordingError::Io`].
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.writer.finish().map_err(RecordingError::container(&self.path))?;
        let buffer = self.writer.into_inner();
        let file = buffer.into_inner().map_err(|error| RecordingError::io(&self.path)(error.into_error()))?;
        file.sync_all().map_err(RecordingError::io(&self.path))
    }

    fn write_image(
        &mut self,
        topic: &str,
        stamp_ns: u64,
        frame: &str,
        image: &EncodedImage,
    ) -> Result<(), RecordingError> {
        let (timestamp, frame_id, data) = (timestamp(stamp_ns), frame.to_owned(), image.bytes.clone());
        match image.format {
            ImageFormat::Jpeg | ImageFormat::Png => {
                let format = image.format.name().to_owned();
                self.write(topic, stamp_ns, &foxglove::CompressedImage { timestamp, frame_id, data, format })
            }
            ImageFormat::Raw { width, height, row_bytes, pixel } => {
                let (step, encoding) = (row_bytes, pixel.name().to_owned());
                let message = foxglove::RawImage { timestamp, frame_id, width, height, encoding, step, data };
                self.write(topic, stamp_ns, &message)
            }
        }
    }

    fn write<M: Schema>(&mut self, topic: &str, stamp_ns: u64, message: &M) -> Result<(), RecordingError> {
        let channel = self.channel::<M>(topic)?;
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages,
            log_time: stamp_ns,
            publish_time: stamp_ns,
        };
        let refused = RecordingError::container(&self.path);
        self.writer.write_to_known_channel(&header, &message.encode_to_vec()).map_err(refused)?;
        self.channels.insert(topic.to_owned(), OpenChannel { messages: channel.messages + 1, ..channel });
        self.flush_if_due(stamp_ns)
    }

    fn channel<M: Schema>(&mut self, topic: &str) -> Result<OpenChannel, RecordingError> {
        if let Some(channel) = self.channels.get(topic) {
            return Ok(*channel);
        }
        let refused = || RecordingError::container(&self.path);
        let schema = self.writer.add_schema(M::NAME, "protobuf", M::DESCRIPTORS).map_err(refused())?;
        let id = self.writer.add_channel(schema, topic, "protobuf", &BTreeMap::new()).map_err(refused())?;
        Ok(OpenChannel { id, messages: 0 })
    }

    fn flush_if_due(&mut self, stamp_ns: u64) -> Result<(), RecordingError> {
        let flushed_ns = *self.flushed_ns.get_or_insert(stamp_ns);
        if stamp_ns.abs_diff(flushed_ns) < self.flush_interval_ns {
            return Ok(());
        }
        self.flushed_ns = Some(stamp_ns);
        self.flush()
    }
}

fn calibration_message(stamp_ns: u64, frame: &str, record: CameraRecord) -> foxglove::CameraCalibration {
    foxglove::CameraCalibration {
        timestamp: timestamp(stamp_ns),
        frame_id: frame.into(),
        width: record.width,
        height: record.height,
        distortion_model: record.distortion_model,
        d: record.d,
        k: record.k.to_vec(),
        r: record.r.to_vec(),
        p: record.p.to_vec(),
    }
}

fn pose_message(pose: &StampedPose) -> foxglove::PoseInFrame {
    foxglove::PoseInFrame {
        timestamp: timestamp(pose.stamp_ns),
        frame_id: WORLD.into(),
        pose: Some(rigid(&pose.world_from_camera)),
    }
}

fn rigid(pose: &Pose) -> foxglove::Pose {
    let t = &pose.translation.vector;
    let q = pose.rotation.quaternion();
    foxglove::Pose {
        position: Some(foxglove::Vector3 { x: t.x, y: t.y, z: t.z }),
        orientation: Some(foxglove::Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }),
    }
}

fn points_message(points: &TruthPoints) -> foxglove::PointCloud {
    use foxglove::packed_element_field::NumericType::{Float32, Uint32};
    let fields = [("x", Float32), ("y", Float32), ("z", Float32), ("id", Uint32)];
    let fields = (0..).step_by(4).zip(fields).map(|(offset, (name, kind))| foxglove::PackedElementField {
        name: name.into(),
        offset,
        r#type: kind.into(),
    });
    let packed = points.points_in_world.iter().zip(&points.ids).flat_map(|(p, id)| {
        let [x, y, z] = [p.x, p.y, p.z].map(|value| (value as f32).to_le_bytes());
        [x, y, z, id.to_le_bytes()].into_iter().flatten()
    });
    foxglove::PointCloud {
        timestamp: timestamp(points.stamp_ns),
        frame_id: WORLD.into(),
        pose: Some(rigid(&Pose::identity())),
        point_stride: 16,
        fields: fields.collect(),
        data: packed.collect(),
    }
}
