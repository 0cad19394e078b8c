//! ROS 2 bags: `sensor_msgs` in CDR, of either byte order, chunked or not.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use common::{HEIGHT, WIDTH, config, jpeg, rig, stamp};
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use recording::import::{ImportKind, ImportRequest, import};
use recording::{
    Calibration, EncodedImage, RecordingConfig, RecordingError, RecordingReader, Topics, decode_gray,
};

/// Writes CDR as ROS 2 does.
struct Cdr {
    bytes: Vec<u8>,
    is_little: bool,
}

impl Cdr {
    fn new(is_little: bool) -> Self {
        Self { bytes: vec![0, u8::from(is_little), 0, 0], is_little }
    }

    fn align(&mut self, size: usize) {
        while !(self.bytes.len() - 4).is_multiple_of(size) {
            self.bytes.push(0);
        }
    }

    fn u32(mut self, value: u32) -> Self {
        self.align(4);
        self.bytes.extend(if self.is_little { value.to_le_bytes() } else { value.to_be_bytes() });
        self
    }

    fn f64s(mut self, values: &[f64]) -> Self {
        for value in values {
            self.align(8);
            self.bytes.extend(if self.is_little { value.to_le_bytes() } else { value.to_be_bytes() });
        }
        self
    }

    fn octets(self, bytes: &[u8]) -> Self {
        let mut cdr = self.u32(bytes.len() as u32);
        cdr.bytes.extend(bytes);
        cdr
    }

    fn string(self, text: &str) -> Self {
        self.octets(&[text.as_bytes(), &[0]].concat())
    }

    fn header(self, stamp_ns: u64) -> Self {
        self.u32((stamp_ns / 1_000_000_000) as u32)
            .u32((stamp_ns % 1_000_000_000) as u32)
            .string("left_optical")
    }
}

fn image(is_little: bool, stamp_ns: u64, encoding: &str, pixels: &[u8]) -> Vec<u8> {
    let mut cdr = Cdr::new(is_little).header(stamp_ns).u32(HEIGHT).u32(WIDTH).string(encoding);
    cdr.bytes.push(0);
    cdr.u32(pixels.len() as u32 / HEIGHT).octets(pixels).bytes
}

fn compressed(stamp_ns: u64, image: &EncodedImage) -> Vec<u8> {
    Cdr::new(true).header(stamp_ns).string("rgb8; jpeg compressed bgr8").octets(&image.bytes).bytes
}

fn camera_info(is_little: bool, shift: f64, cx_px: f64) -> Vec<u8> {
    let left = rig().left;
    let (fx, fy, cy) = (left.fx_px, left.fy_px, left.cy_px);
    let cdr = Cdr::new(is_little).header(stamp(0)).u32(HEIGHT).u32(WIDTH).string("plumb_bob").u32(5);
    let cdr = cdr.f64s(&[0.0; 5]).f64s(&[fx, 0.0, cx_px, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    let cdr = cdr.f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let cdr = cdr.f64s(&[fx, 0.0, cx_px, shift, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    cdr.u32(0).u32(0).u32(0).u32(0).u32(0).u32(0).octets(&[]).bytes
}

/// A bag under construction.
struct Bag {
    writer: Writer<File>,
    sequence: u32,
}

impl Bag {
    fn create(path: &Path, is_chunked: bool) -> Self {
        let options = WriteOptions::new().use_chunks(is_chunked).profile("ros2");
        Self { writer: options.create(File::create(path).unwrap()).unwrap(), sequence: 0 }
    }

    fn add(&mut self, topic: &str, kind: &str, stamp_ns: u64, data: &[u8]) {
        let schema = self.writer.add_schema(&format!("sensor_msgs/msg/{kind}"), "ros2msg", b"").unwrap();
        let channel_id = self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        self.sequence += 1;
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: stamp_ns, publish_time: stamp_ns };
        self.writer.write_to_known_channel(&header, data).unwrap();
    }

    fn add_calibration(&mut self, is_little: bool) {
        let rig = rig();
        let shift = -rig.left.fx_px * rig.baseline_m;
        self.add("/l/info", "CameraInfo", stamp(0), &camera_info(is_little, 0.0, rig.left.cx_px));
        self.add("/r/info", "CameraInfo", stamp(0), &camera_info(is_little, shift, rig.right_cx_px));
    }
}

fn ros_config() -> RecordingConfig {
    let topics = Topics {
        left_image: "/l/image".into(),
        right_image: "/r/image".into(),
        left_calibration: "/l/info".into(),
        right_calibration: "/r/info".into(),
        ..config().topics
    };
    RecordingConfig { topics, ..config() }
}

#[test]
fn a_bag_of_raw_images_plays_in_either_byte_order_chunked_or_not() {
    let pixels: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| i as u8).collect();
    for (is_little, is_chunked) in [(true, true), (true, false), (false, true), (false, false)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.mcap");
        let mut bag = Bag::create(&path, is_chunked);
        bag.add_calibration(is_little);
        for index in 0..20 {
            for topic in ["/l/image", "/r/image"] {
                let data = image(is_little, stamp(index), "mono8", &pixels);
                bag.add(topic, "Image", stamp(index), &data);
            }
        }
        bag.writer.finish().unwrap();
        let reader = RecordingReader::open(&path, &ros_config()).unwrap();
        let Calibration::Rectified(read) = reader.calibration().unwrap() else { panic!("not rectified") };
        assert!((read.baseline_m - rig().baseline_m).abs() < 1e-15);
        assert_eq!((read.left, read.right_cx_px), (rig().left, rig().right_cx_px));
        let pairs: Vec<_> = reader.stereo().unwrap().map(Result::unwrap).collect();
        assert_eq!(pairs.len(), 20);
        assert_eq!(decode_gray(&pairs[7].left, (WIDTH, HEIGHT)).unwrap().pixels(), pixels);
    }
}

#[test]
fn compressed_images_that_come_late_or_alone_are_ordered_or_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut bag = Bag::create(&path, false);
    // The right camera's driver publishes two frames later, loses frame 5 and repeats frame 7.
    for index in 0..22 {
        if index < 20 {
            bag.add("/l/image", "CompressedImage", stamp(index), &compressed(stamp(index), &jpeg(0)));
        }
        for late in [index.checked_sub(2), (index == 9).then_some(7)].into_iter().flatten() {
            if late != 5 {
                bag.add("/r/image", "CompressedImage", stamp(index), &compressed(stamp(late), &jpeg(1)));
            }
        }
    }
    bag.writer.finish().unwrap();
    let reader = RecordingReader::open(&path, &ros_config()).unwrap();
    let mut pairs = reader.stereo().unwrap();
    let stamps: Vec<_> = pairs.by_ref().map(|pair| pair.unwrap().stamp_ns).collect();
    assert_eq!(stamps, (0..20).filter(|&index| index != 5).map(stamp).collect::<Vec<_>>());
    let statistics = pairs.statistics();
    assert_eq!((statistics.unpaired_left, statistics.unpaired_right, statistics.duplicates), (1, 0, 1));
}

#[test]
fn messages_that_make_no_sense_are_counted_and_the_first_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut bag = Bag::create(&path, true);
    bag.add("/l/image", "Image", stamp(0), &image(true, stamp(0), "bayer_rggb8", &[0; 768]));
    bag.add("/l/image", "Image", stamp(0), &[]);
    bag.add("/r/image", "CompressedImage", stamp(0), &compressed(stamp(0), &jpeg(1)));
    bag.writer.finish().unwrap();
    let reader = RecordingReader::open(&path, &ros_config()).unwrap();
    let mut pairs = reader.stereo().unwrap();
    assert_eq!(pairs.by_ref().count(), 0);
    assert_eq!((pairs.statistics().malformed, pairs.statistics().unpaired_right), (2, 1));
    let told = pairs.statistics().first_malformed.clone().unwrap();
    assert!(told.contains("bag.mcap: topic /l/image: encoding: \"bayer_rggb8\""), "{told}");
}

#[test]
fn a_calibration_without_a_baseline_names_file_topic_and_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut bag = Bag::create(&path, true);
    bag.add("/l/info", "CameraInfo", stamp(0), &camera_info(true, 0.0, 15.0));
    bag.add("/r/info", "CameraInfo", stamp(0), &camera_info(true, 0.0, 15.0));
    bag.writer.finish().unwrap();
    let error = RecordingReader::open(&path, &ros_config()).unwrap().calibration().unwrap_err();
    assert!(matches!(error, RecordingError::Message { .. }));
    let told = error.to_string();
    assert!(["bag.mcap", "/r/info", "P[3]"].iter().all(|part| told.contains(part)), "{told}");
}

#[test]
fn a_bag_of_several_files_becomes_a_recording_with_the_usual_topics() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    std::fs::write(bag.join("metadata.yaml"), "rosbag2_bagfile_information:\n  storage_identifier: mcap\n")
        .unwrap();
    for part in 0..2 {
        let mut file = Bag::create(&bag.join(format!("bag_{part}.mcap")), true);
        if part == 0 {
            file.add_calibration(true);
        }
        for index in 3 * part..3 * (part + 1) {
            for topic in ["/l/image", "/r/image"] {
                file.add(
                    topic,
                    "CompressedImage",
                    stamp(index),
                    &compressed(stamp(index), &jpeg(index as u32)),
                );
            }
        }
        file.writer.finish().unwrap();
    }
    let (recording, topics) = (folder.path().join("rec.mcap"), ros_config().topics);
    let request = ImportRequest {
        bag_topics: Some(&topics),
        ..ImportRequest::new(ImportKind::Ros2bag, &bag, &recording)
    };
    let mut told = Vec::new();
    let summary = import(&request, &config(), &mut |done, total| told.push((done, total))).unwrap();
    assert_eq!((summary.pairs, summary.last_stamp_ns, told.last()), (6, stamp(5), Some(&(6, 6))));
    let reader = RecordingReader::open(&recording, &config()).unwrap();
    assert!(matches!(reader.calibration().unwrap(), Calibration::Rectified(read) if read.left == rig().left));
    let stamps: Vec<_> = reader.stereo().unwrap().map(|pair| pair.unwrap().stamp_ns).collect();
    assert_eq!(stamps, (0..6).map(stamp).collect::<Vec<_>>());
    assert_eq!(reader.stereo().unwrap().nth(4).unwrap().unwrap().left.bytes, jpeg(4).bytes);
}

#[test]
fn a_bag_that_cannot_be_imported_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    let recording = folder.path().join("rec.mcap");
    let refusal = || {
        let request = ImportRequest::new(ImportKind::Ros2bag, &bag, &recording);
        import(&request, &config(), &mut |_, _| {}).unwrap_err().to_string()
    };
    assert!(refusal().contains("no *.mcap file"));
    std::fs::write(bag.join("bag_0.db3"), b"SQLite format 3").unwrap();
    assert!(refusal().contains("ros2 bag convert"));
    let mut file = Bag::create(&bag.join("bag_0.mcap"), true);
    file.add("/camera/image", "Image", stamp(0), &image(true, stamp(0), "mono8", &[0; 768]));
    file.writer.finish().unwrap();
    let told = refusal();
    assert!(told.contains("/camera/image") && told.contains("recording.topics"), "{told}");
    assert!(!recording.exists(), "a refused import leaves nothing");
}
