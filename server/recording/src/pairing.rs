//! Puts the images of two cameras, and masks, together by equal stamps and in the order of stamps.
//!
//! A few stamps are held back; the oldest leaves when one more comes. What leaves without its other eye is
//! counted, never paired with another frame's; what comes after its stamp has left is dropped and counted.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::EncodedImage;

/// One moment of both cameras.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StereoMessage {
    /// Time of both images.
    pub stamp_ns: u64,
    /// The left camera's image.
    pub left: EncodedImage,
    /// The right camera's image.
    pub right: EncodedImage,
    /// What instruments cover in the left image.
    pub mask: Option<EncodedImage>,
}

/// What became of the messages that were read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PairingStatistics {
    /// Pairs given out.
    pub pairs: u64,
    /// Left images without a right one.
    pub unpaired_left: u64,
    /// Right images without a left one.
    pub unpaired_right: u64,
    /// Images dropped as their eye already had one of that stamp.
    pub duplicates: u64,
    /// Images dropped as later ones had been given out.
    pub late: u64,
    /// Messages that could not be understood.
    pub malformed: u64,
    /// What was wrong with the first of those.
    pub first_malformed: Option<String>,
}

/// Which of the three streams an image belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    Left,
    Right,
    Mask,
}

/// The images of one stamp so far.
#[derive(Default)]
struct Moment {
    left: Option<EncodedImage>,
    right: Option<EncodedImage>,
    mask: Option<EncodedImage>,
}

pub(crate) struct Pairing {
    window: usize,
    waiting: BTreeMap<u64, Moment>,
    left_ns: Option<u64>,
    pub statistics: PairingStatistics,
}

impl Pairing {
    /// Holds back at most `window` stamps.
    pub fn new(window: usize) -> Self {
        Self { window, waiting: BTreeMap::new(), left_ns: None, statistics: PairingStatistics::default() }
    }

    /// Takes in an image.
    pub fn insert(&mut self, stream: Stream, stamp_ns: u64, image: EncodedImage) {
        if self.left_ns.is_some_and(|left_ns| stamp_ns <= left_ns) {
            self.statistics.late += 1;
            return;
        }
        let moment = match self.waiting.entry(stamp_ns) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(Moment::default()),
        };
        let slot = match stream {
            Stream::Left => &mut moment.left,
            Stream::Right => &mut moment.right,
            Stream::Mask => &mut moment.mask,
        };
        if slot.is_some() {
            self.statistics.duplicates += 1;
        } else {
            *slot = Some(image);
        }
    }

    /// The oldest pair, once more stamps wait than are held back.
    pub fn pop(&mut self) -> Option<StereoMessage> {
        while self.waiting.len() > self.window {
            if let Some(pair) = self.release() {
                return Some(pair);
            }
        }
        None
    }

    /// The oldest pair, once nothing more will come.
    pub fn drain(&mut self) -> Option<StereoMessage> {
        while !self.waiting.is_empty() {
            if let Some(pair) = self.release() {
                return Some(pair);
            }
        }
        None
    }

    fn release(&mut self) -> Option<StereoMessage> {
        let (stamp_ns, moment) = self.waiting.pop_first()?;
        self.left_ns = Some(stamp_ns);
        match (moment.left, moment.right) {
            (Some(left), Some(right)) => {
                self.statistics.pairs += 1;
                return Some(StereoMessage { stamp_ns, left, right, mask: moment.mask });
            }
            (Some(_), None) => self.statistics.unpaired_left += 1,
            (None, Some(_)) => self.statistics.unpaired_right += 1,
            (None, None) => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ImageFormat;

    fn image(tag: u8) -> EncodedImage {
        EncodedImage { format: ImageFormat::Jpeg, bytes: vec![tag] }
    }

    fn run(window: usize, messages: &[(Stream, u64)]) -> (Vec<u64>, PairingStatistics) {
        let mut pairing = Pairing::new(window);
        let mut stamps = Vec::new();
        for &(stream, stamp_ns) in messages {
            pairing.insert(stream, stamp_ns, image(stamp_ns as u8));
            stamps.extend(std::iter::from_fn(|| pairing.pop()).map(|pair| pair.stamp_ns));
        }
        while let Some(pair) = pairing.drain() {
            assert_eq!(pair.left.bytes, pair.right.bytes, "images of two frames were paired");
            stamps.push(pair.stamp_ns);
        }
        (stamps, pairing.statistics)
    }

    use Stream::{Left, Mask, Right};

    #[test]
    fn a_missing_eye_is_counted_and_never_replaced_by_another_frames() {
        let messages = [(Left, 1), (Left, 2), (Right, 2), (Right, 3), (Left, 4), (Right, 4)];
        let (stamps, statistics) = run(2, &messages);
        assert_eq!(stamps, [2, 4]);
        assert_eq!((statistics.unpaired_left, statistics.unpaired_right), (1, 1));
    }

    #[test]
    fn stamps_out_of_order_inside_the_window_are_put_in_order() {
        let messages = [(Right, 2), (Left, 3), (Left, 1), (Right, 1), (Left, 2), (Right, 3)];
        assert_eq!(run(3, &messages).0, [1, 2, 3]);
    }

    #[test]
    fn what_comes_after_its_time_is_dropped_and_counted() {
        let (stamps, statistics) = run(
            1,
            &[(Left, 1), (Right, 1), (Left, 5), (Right, 5), (Left, 6), (Right, 6), (Left, 2), (Right, 2)],
        );
        assert_eq!(stamps, [1, 5, 6]);
        assert_eq!(statistics.late, 2);
    }

    #[test]
    fn a_second_image_of_the_same_eye_and_stamp_is_a_duplicate() {
        let (stamps, statistics) = run(4, &[(Left, 1), (Left, 1), (Right, 1)]);
        assert_eq!((stamps.len(), statistics.duplicates), (1, 1));
    }

    #[test]
    fn a_mask_joins_the_pair_of_its_stamp_and_alone_is_nothing() {
        let mut pairing = Pairing::new(4);
        for (stream, stamp_ns) in [(Left, 1), (Right, 1), (Mask, 1), (Mask, 2)] {
            pairing.insert(stream, stamp_ns, image(0));
        }
        assert!(pairing.drain().unwrap().mask.is_some());
        assert_eq!(pairing.drain(), None);
        assert_eq!(pairing.statistics.unpaired_left + pairing.statistics.unpaired_right, 0);
    }
}
