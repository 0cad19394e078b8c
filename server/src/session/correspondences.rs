//! Joins the tracker's features of a frame to those of the last frame that was fused.
//!
//! The tracker numbers its features from frame to frame. Which frames reach the model is decided later and elsewhere, so
//! the join is made here, by those numbers, across whatever was dropped in between.

use std::collections::BTreeMap;

use dense::Correspondence;
use tracking::{TrackId, TrackedFeature};

/// A feature of a frame on its way to the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NumberedFeature {
    track: TrackId,
    pixel: [f32; 2],
    /// Whether the camera's motion explains its last step.
    rigid: bool,
}

/// The features that can be found again.
pub(super) fn numbered(features: &[TrackedFeature]) -> Vec<NumberedFeature> {
    let numbered = features.iter().filter_map(|feature| {
        let rigid = feature.motion.is_none_or(|motion| motion.rigid);
        Some(NumberedFeature { track: feature.track?, pixel: feature.pixel.into(), rigid })
    });
    numbered.collect()
}

/// Where the features of the last fused frame were.
#[derive(Debug, Default)]
pub(super) struct LastFused {
    pixels: BTreeMap<TrackId, [f32; 2]>,
}

impl LastFused {
    /// The features that were there too, in the order of the frame.
    pub(super) fn join(&self, features: &[NumberedFeature]) -> Vec<Correspondence> {
        let joined = features.iter().filter_map(|&NumberedFeature { track, pixel, rigid }| {
            Some(Correspondence { previous_pixel: *self.pixels.get(&track)?, pixel, rigid })
        });
        joined.collect()
    }

    /// The frame was fused.
    pub(super) fn replace(&mut self, features: &[NumberedFeature]) {
        self.pixels = features.iter().map(|feature| (feature.track, feature.pixel)).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(track: u64, x: f32, rigid: bool) -> NumberedFeature {
        NumberedFeature { track: TrackId(track), pixel: [x, 10.0], rigid }
    }

    #[test]
    fn frames_that_were_not_fused_are_bridged() {
        let mut last = LastFused::default();
        last.replace(&[feature(1, 5.0, true), feature(2, 20.0, true)]);
        // a frame that was dropped in between leaves no trace
        let joined = last.join(&[feature(2, 26.0, false), feature(3, 40.0, true), feature(1, 6.0, true)]);
        let expected = [([20.0, 10.0], [26.0, 10.0], false), ([5.0, 10.0], [6.0, 10.0], true)];
        let expected =
            expected.map(|(previous_pixel, pixel, rigid)| Correspondence { previous_pixel, pixel, rigid });
        assert_eq!(joined, expected);
    }

    #[test]
    fn nothing_joins_the_first_frame() {
        assert!(LastFused::default().join(&[feature(1, 5.0, true)]).is_empty());
    }
}
