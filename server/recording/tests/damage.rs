//! Recordings that were cut short or damaged are read up to their last good record.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::path::Path;

use common::{config, stamp};
use proptest::prelude::*;
use recording::{Compression, RecordingConfig, RecordingReader, RecordingWriter};

const FRAMES: u64 = 40;

fn recording(folder: &Path, config: &RecordingConfig) -> Vec<u8> {
    let path = folder.join("whole.mcap");
    common::write_recording(&path, FRAMES, config);
    std::fs::read(path).unwrap()
}

/// Replays `bytes` as a file; gives the number of pairs, having checked that they are the first ones.
fn replayed(folder: &Path, bytes: &[u8]) -> Option<usize> {
    let path = folder.join("damaged.mcap");
    std::fs::write(&path, bytes).unwrap();
    let reader = RecordingReader::open(&path, &config()).ok()?;
    let stamps = common::replayed_stamps(&reader);
    assert!(stamps.iter().copied().eq((0..stamps.len() as u64).map(stamp)), "{stamps:?}");
    // Whatever these give, they return.
    let _ = (reader.calibration().is_ok(), reader.poses().is_ok(), reader.metadata().is_ok());
    let _ = (reader.depths().unwrap().count(), reader.points().unwrap().count());
    let _ = reader.attachment("truth_mesh.npz").is_ok();
    Some(stamps.len())
}

#[test]
fn a_file_cut_anywhere_replays_its_first_pairs_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Zstd] {
        let bytes = recording(folder.path(), &RecordingConfig { compression, ..config() });
        let mut most = 0;
        // Every 499th byte, and each of the last hundred: chunks, index and footer are all cut.
        let cuts = (8..bytes.len()).step_by(499).chain(bytes.len() - 100..bytes.len());
        for length in cuts {
            let pairs = replayed(folder.path(), &bytes[..length]).unwrap();
            assert!(pairs >= most, "{pairs} pairs from {length} bytes, {most} from fewer");
            most = pairs;
            assert!(
                RecordingReader::open(&folder.path().join("damaged.mcap"), &config()).unwrap().truncated()
            );
        }
        assert_eq!(most, FRAMES as usize);
    }
}

#[test]
fn a_process_killed_while_writing_loses_at_most_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.mcap");
    let mut writer = RecordingWriter::create(&path, &config()).unwrap();
    for index in 0..100 {
        common::write_frame(&mut writer, index);
    }
    // What a killed process leaves is what the operating system has been given so far.
    let bytes = std::fs::read(&path).unwrap();
    let pairs = replayed(folder.path(), &bytes).unwrap();
    assert!(stamp(99) - stamp(pairs as u64) <= 1_000_000_000, "{pairs} of 100 pairs are left");
}

#[test]
fn a_writer_that_is_dropped_closes_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dropped.mcap");
    let mut writer = RecordingWriter::create(&path, &config()).unwrap();
    common::write_frame(&mut writer, 0);
    drop(writer);
    let reader = RecordingReader::open(&path, &config()).unwrap();
    assert!(!reader.truncated());
    assert_eq!(common::replayed_stamps(&reader), [stamp(0)]);
}

#[test]
fn a_flipped_bit_in_an_indexed_file_ends_every_reader_and_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let mut bytes = recording(folder.path(), &RecordingConfig { compression, ..config() });
        // In an image of the first chunk, where nothing but the checksum can tell.
        let image = bytes.windows(2).position(|two| two == [0xFF, 0xD8]).unwrap_or(4000);
        bytes[image + 300] ^= 1;
        let path = folder.path().join("flipped.mcap");
        std::fs::write(&path, &bytes).unwrap();
        let reader = || RecordingReader::open(&path, &config()).unwrap();
        assert!(!reader().truncated(), "the index is whole");
        let stereo = reader();
        assert_eq!(stereo.stereo().unwrap().count(), 0, "{compression:?}");
        assert!(stereo.truncated());
        let poses = reader();
        assert!(poses.poses().unwrap().is_empty() && poses.damage().is_some());
    }
}

#[test]
fn a_record_that_claims_more_than_the_file_ends_the_replay() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = recording(folder.path(), &RecordingConfig { compression: Compression::None, ..config() });
    // The first record behind the header record; its length is made absurd.
    let header_bytes = u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    let second = 8 + 9 + header_bytes;
    for length in [u64::MAX, 1 << 62, 1 << 40, bytes.len() as u64] {
        let mut hostile = bytes[..bytes.len() - 8].to_vec();
        hostile[second + 1..second + 9].copy_from_slice(&length.to_le_bytes());
        assert_eq!(replayed(folder.path(), &hostile), Some(0));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_never_panic(flips in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..), 1..6)) {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = recording(folder.path(), &config());
        for (at, mask) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= mask;
        }
        let path = folder.path().join("flipped.mcap");
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(reader) = RecordingReader::open(&path, &config()) {
            let _ = reader.stereo().map(Iterator::count);
            let _ = (reader.calibration().is_ok(), reader.poses().is_ok(), reader.metadata().is_ok());
            let _ = reader.depths().map(Iterator::count);
            let _ = reader.attachment("truth_mesh.npz").is_ok();
        }
    }
}
