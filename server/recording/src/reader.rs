//! Reading recordings.

use std::path::Path;

use geometry::Raster;
use geometry::trajectory::StampedPose;

use crate::calibration::{self, Calibration, CameraRecord};
use crate::pairing::{Pairing, PairingStatistics, StereoMessage, Stream};
use crate::source::{self, McapFile, Messages, Metadata, RawMessage};
use crate::truth::{StampedDepth, TruthPoints};
use crate::wire::{self, Malformed};
use crate::{RecordingConfig, RecordingError, Topics};

const MIB: usize = 1 << 20;

/// A recording opened for reading; every accessor reads the file anew, a chunk at a time. Clones share what damage was
/// met.
#[derive(Clone)]
pub struct RecordingReader {
    file: McapFile,
    topics: Topics,
    pairing_window_frames: usize,
}

impl RecordingReader {
    /// Opens an MCAP file and reads its end; a file that was cut short is opened too, see [`Self::damage`].
    ///
    /// # Errors
    /// [`RecordingError::Io`], or [`RecordingError::Container`] where it is no MCAP file at all.
    pub fn open(path: &Path, config: &RecordingConfig) -> Result<Self, RecordingError> {
        Ok(Self {
            file: McapFile::open(path, config.record_limit_mib.saturating_mul(MIB))?,
            topics: config.topics.clone(),
            pairing_window_frames: config.pairing_window_frames,
        })
    }

    /// Whether anything of the file cannot be read: it was not closed properly, or what was read so far met damage.
    pub fn truncated(&self) -> bool {
        self.damage().is_some()
    }

    /// What is wrong with the file, as far as any of its readers has come; each of them ends there.
    pub fn damage(&self) -> Option<&str> {
        self.file.damage()
    }

    /// The number of left images, where the file's end tells it: how long a replay will be.
    pub fn expected_pairs(&self) -> Option<u64> {
        self.message_count(&self.topics.left_image)
    }

    /// The number of messages of true points, where the file's end tells it.
    pub fn expected_truth_points(&self) -> Option<u64> {
        self.message_count(&self.topics.truth_points)
    }

    fn message_count(&self, topic: &str) -> Option<u64> {
        let summary = self.file.summary()?;
        let counts = &summary.stats.as_ref()?.channel_message_counts;
        let channels = summary.channels.values().filter(|channel| channel.topic == topic);
        Some(channels.filter_map(|channel| counts.get(&channel.id)).sum())
    }

    /// The first calibration of the two cameras.
    ///
    /// # Errors
    /// [`RecordingError::MissingTopic`] where an eye has none, [`RecordingError::Message`] names the field that is wrong.
    pub fn calibration(&self) -> Result<Calibration, RecordingError> {
        let topics = [self.topics.left_calibration.as_str(), self.topics.right_calibration.as_str()];
        let mut records: [Option<CameraRecord>; 2] = [None, None];
        for message in self.file.messages(&topics)? {
            let message = message?;
            let eye = usize::from(message.channel.topic != topics[0]);
            if records[eye].is_none() {
                records[eye] =
                    Some(self.understood(&message, wire::calibration(&message.channel, &message.data))?);
            }
            if let [Some(left), Some(right)] = &records {
                return calibration::from_records(left, right).map_err(|wrong| {
                    let topic = topics[usize::from(wrong.eye == geometry::Eye::Right)];
                    self.message_error(topic, Malformed { field: wrong.field, problem: wrong.problem })
                });
            }
        }
        let (topic, key) = match &records {
            [None, _] => (topics[0], "left_calibration"),
            [_, _] => (topics[1], "right_calibration"),
        };
        Err(self.missing(topic, key))
    }

    /// The stereo pairs in the order of their stamps.
    ///
    /// # Errors
    /// [`RecordingError::Io`] or [`RecordingError::Container`] where the file cannot be read; and
    /// [`RecordingError::MissingTopic`] where its index lists no images of an eye.
    pub fn stereo(&self) -> Result<StereoMessages, RecordingError> {
        self.stereo_from(0)
    }

    /// As [`Self::stereo`], from a time on; an index makes it quick.
    ///
    /// # Errors
    /// As [`Self::stereo`].
    pub fn stereo_from(&self, from_ns: u64) -> Result<StereoMessages, RecordingError> {
        let Topics { left_image, right_image, left_mask, .. } = &self.topics;
        for (topic, key) in [(left_image, "left_image"), (right_image, "right_image")] {
            if self.message_count(topic) == Some(0) {
                return Err(self.missing(topic, key));
            }
        }
        Ok(StereoMessages {
            messages: self.file.messages_from(&[left_image, right_image, left_mask], from_ns)?,
            path: self.file.path.clone(),
            topics: self.topics.clone(),
            pairing: Pairing::new(self.pairing_window_frames),
            ended: false,
        })
    }

    /// The stamps of the first and the last pair; the last one to a chunk where the file has an index, else the whole
    /// file is read.
    ///
    /// # Errors
    /// As [`Self::stereo`]; [`RecordingError::Input`] where there is no pair.
    pub fn stereo_span_ns(&self) -> Result<(u64, u64), RecordingError> {
        let first = self.stereo()?.next().transpose()?;
        let none = || RecordingError::input(&self.file.path, "there is no stereo pair in it");
        let first_ns = first.ok_or_else(none)?.stamp_ns;
        let last_ns = match self.file.last_ns(&self.topics.left_image) {
            Some(last_ns) => last_ns,
            None => self.stereo()?.try_fold(first_ns, |_, pair| pair.map(|pair| pair.stamp_ns))?,
        };
        Ok((first_ns, last_ns.max(first_ns)))
    }

    /// All true poses, `world_from_camera`, in the order of the file; empty without the topic.
    ///
    /// # Errors
    /// [`RecordingError::Message`] for a pose that makes no sense, [`RecordingError::Io`].
    pub fn poses(&self) -> Result<Vec<StampedPose>, RecordingError> {
        self.poses_on(&self.topics.truth_pose)
    }

    /// All estimated poses that a replay or session wrote, `world_from_camera`; empty without the topic.
    ///
    /// # Errors
    /// As [`Self::poses`].
    pub fn estimated_poses(&self) -> Result<Vec<StampedPose>, RecordingError> {
        self.poses_on(&self.topics.pose)
    }

    fn poses_on(&self, topic: &str) -> Result<Vec<StampedPose>, RecordingError> {
        self.file
            .messages(&[topic])?
            .map(|message| {
                let message = message?;
                self.understood(&message, wire::pose(&message.data, message.log_time_ns))
            })
            .collect()
    }

    /// True depth maps of the left rectified view, one read at a time.
    ///
    /// # Errors
    /// The iterator gives [`RecordingError::Message`] for a map that makes no sense, [`RecordingError::Io`].
    pub fn depths(
        &self,
    ) -> Result<impl Iterator<Item = Result<StampedDepth, RecordingError>> + '_, RecordingError> {
        Ok(self.file.messages(&[&self.topics.truth_depth])?.map(|message| {
            let message = message?;
            let depth = self.understood(&message, wire::depth(&message.data, message.log_time_ns))?;
            Ok(StampedDepth {
                stamp_ns: depth.stamp_ns,
                depth: Raster::from_vec(depth.width, depth.height, depth.depth_m)?,
            })
        }))
    }

    /// True places of the material points, one time after another.
    ///
    /// # Errors
    /// The iterator gives [`RecordingError::Message`] for points that make no sense, [`RecordingError::Io`].
    pub fn points(
        &self,
    ) -> Result<impl Iterator<Item = Result<TruthPoints, RecordingError>> + '_, RecordingError> {
        Ok(self.file.messages(&[&self.topics.truth_points])?.map(|message| {
            let message = message?;
            self.understood(&message, wire::point_cloud(&message.data, message.log_time_ns))
        }))
    }

    /// The bytes of an attached file, such as `truth_mesh.npz`.
    ///
    /// # Errors
    /// [`RecordingError::Io`], or [`RecordingError::Container`] where its checksum is wrong.
    pub fn attachment(&self, name: &str) -> Result<Option<Vec<u8>>, RecordingError> {
        source::attachment(&self.file, name)
    }

    /// The named groups of keys and values that the writer left.
    ///
    /// # Errors
    /// [`RecordingError::Io`], or [`RecordingError::Container`] for a damaged group.
    pub fn metadata(&self) -> Result<Metadata, RecordingError> {
        source::metadata(&self.file)
    }

    fn understood<T>(
        &self,
        message: &RawMessage,
        decoded: Result<T, Malformed>,
    ) -> Result<T, RecordingError> {
        decoded.map_err(|wrong| self.message_error(&message.channel.topic, wrong))
    }

    fn message_error(&self, topic: &str, wrong: Malformed) -> RecordingError {
        RecordingError::Message {
            path: self.file.path.clone(),
            topic: topic.to_owned(),
            field: wrong.field,
            problem: wrong.problem,
        }
    }

    fn missing(&self, topic: &str, key: &'static str) -> RecordingError {
        let channels = self.file.summary().into_iter().flat_map(|summary| summary.channels.values());
        let mut present: Vec<String> = channels.map(|channel| channel.topic.clone()).collect();
        present.sort();
        if present.is_empty() {
            present.push("no list of topics".into());
        }
        RecordingError::MissingTopic { path: self.file.path.clone(), topic: topic.to_owned(), key, present }
    }
}

/// An iterator over the stereo pairs of a recording, in the order of their stamps.
pub struct StereoMessages {
    messages: Messages,
    path: std::path::PathBuf,
    topics: Topics,
    pairing: Pairing,
    ended: bool,
}

impl StereoMessages {
    /// What became of the messages read so far.
    pub fn statistics(&self) -> &PairingStatistics {
        &self.pairing.statistics
    }

    fn take_in(&mut self, message: &RawMessage) {
        let topic = &message.channel.topic;
        let stream = if *topic == self.topics.left_image {
            Stream::Left
        } else if *topic == self.topics.right_image {
            Stream::Right
        } else {
            Stream::Mask
        };
        match wire::image(&message.channel, message.log_time_ns, &message.data) {
            Ok(image) => self.pairing.insert(stream, image.stamp_ns, image.image),
            Err(wrong) => {
                let statistics = &mut self.pairing.statistics;
                statistics.malformed += 1;
                statistics.first_malformed.get_or_insert_with(|| {
                    format!("{}: topic {topic}: {}: {}", self.path.display(), wrong.field, wrong.problem)
                });
            }
        }
    }
}

impl Iterator for StereoMessages {
    /// Only what the operating system refuses is an error; what cannot be understood is counted.
    type Item = Result<StereoMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.ended {
            if let Some(pair) = self.pairing.pop() {
                return Some(Ok(pair));
            }
            match self.messages.next() {
                Some(Ok(message)) => self.take_in(&message),
                Some(Err(error)) => return Some(Err(error)),
                None => self.ended = true,
            }
        }
        self.pairing.drain().map(Ok)
    }
}
