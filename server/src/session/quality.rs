//! Whether a picture is fit for fusion: black, frozen, blurred ones and those from outside the body are not (design
//! section 11).

use std::hash::{DefaultHasher, Hash, Hasher};

use geometry::{Gray, Rgb};
use serde::Deserialize;

/// Section `[quality]` of the configuration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QualityConfig {
    /// A pixel darker than this (0-255) shows nothing.
    pub dark_level: u8,
    /// A picture with a larger share of dark pixels is black.
    pub dark_share_max: f64,
    /// A coloured picture with a smaller share of tissue-coloured pixels is none of the inside of a body; 0 turns this
    /// off.
    pub tissue_share_min: f64,
    /// So many such pictures in a row are believed.
    pub out_of_body_pictures: u32,
    /// A picture whose sharpness falls below this share of its recent median is blurred.
    pub sharpness_ratio_min: f64,
    /// Number of recent pictures that the sharpness is compared with.
    pub sharpness_window: usize,
}

/// The verdict on one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameQuality {
    /// Fit for fusion.
    Good,
    /// Nothing can be seen.
    Black,
    /// The same picture as before, to the last bit.
    Frozen,
    /// No tissue: the scope is outside.
    OutOfBody,
    /// Much less sharp than those before.
    Blurred,
}

impl FrameQuality {
    /// Only good pictures are fused.
    pub fn allows_fusion(self) -> bool {
        self == Self::Good
    }

    /// For people and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Black => "black",
            Self::Frozen => "frozen",
            Self::OutOfBody => "out_of_body",
            Self::Blurred => "blurred",
        }
    }
}

/// A pixel is lit from this level of its strongest channel on.
const LIT_LEVEL: u8 = 40;
/// A highlight has no channel below this, and no colour to judge.
const HIGHLIGHT_LEVEL: u8 = 230;
/// Levels between the strongest and the weakest channel of a pixel with a colour.
const COLOURED_SPREAD: u8 = 16;
/// Share of such pixels in the picture of a colour camera.
const COLOURED_SHARE_MIN: f64 = 0.02;
/// Red of a warm pixel, in percent of its next channel.
const WARM_PERCENT: u32 = 115;

/// Judges pictures in the order they come.
pub struct QualityGate {
    config: QualityConfig,
    previous_hash: Option<u64>,
    without_tissue: u32,
    recent_sharpness: std::collections::VecDeque<f64>,
}

impl QualityGate {
    /// A gate that has seen nothing.
    pub fn new(config: &QualityConfig) -> Self {
        Self {
            config: config.clone(),
            previous_hash: None,
            without_tissue: 0,
            recent_sharpness: std::collections::VecDeque::new(),
        }
    }

    /// The verdict on the next picture, given in grey and in colour.
    pub fn assess(&mut self, picture: &Gray, in_colour: &Rgb) -> FrameQuality {
        let hash = content_hash(picture);
        let frozen = self.previous_hash.replace(hash) == Some(hash);
        if dark_share(picture, self.config.dark_level) > self.config.dark_share_max {
            FrameQuality::Black
        } else if frozen {
            FrameQuality::Frozen
        } else if self.is_out_of_body(in_colour) {
            FrameQuality::OutOfBody
        } else if self.is_blurred(sharpness(picture)) {
            FrameQuality::Blurred
        } else {
            FrameQuality::Good
        }
    }

    fn is_out_of_body(&mut self, picture: &Rgb) -> bool {
        let none = tissue_share(picture).is_some_and(|share| share < self.config.tissue_share_min);
        self.without_tissue = if none { self.without_tissue.saturating_add(1) } else { 0 };
        none && self.without_tissue >= self.config.out_of_body_pictures
    }

    /// Blurred pictures enter the window too, so that a lasting change of scene is accepted after half of it.
    fn is_blurred(&mut self, sharpness: f64) -> bool {
        let mut sorted: Vec<f64> = self.recent_sharpness.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        let blurred = sorted
            .get(sorted.len() / 2)
            .is_some_and(|median| sharpness < self.config.sharpness_ratio_min * median);
        if self.recent_sharpness.len() >= self.config.sharpness_window {
            self.recent_sharpness.pop_front();
        }
        self.recent_sharpness.push_back(sharpness);
        blurred
    }
}

fn content_hash(picture: &Gray) -> u64 {
    let mut hasher = DefaultHasher::new();
    picture.pixels().hash(&mut hasher);
    hasher.finish()
}

fn dark_share(picture: &Gray, dark_level: u8) -> f64 {
    let dark = picture.pixels().iter().filter(|&&level| level < dark_level).count();
    dark as f64 / picture.pixels().len().max(1) as f64
}

/// The share of warm pixels among the lit ones: blood makes red the strongest channel of all tissue (measured: 0.88 and
/// more of heart, liver, kidney and abdomen). `None` where the picture has no colour, as of a monochrome camera.
fn tissue_share(picture: &Rgb) -> Option<f64> {
    let (mut lit, mut warm, mut coloured) = (0_u64, 0_u64, 0_u64);
    for &[red, green, blue] in picture.pixels() {
        let (most, least) = (red.max(green).max(blue), red.min(green).min(blue));
        if most < LIT_LEVEL || least > HIGHLIGHT_LEVEL {
            continue;
        }
        lit += 1;
        coloured += u64::from(most - least > COLOURED_SPREAD);
        warm += u64::from(u32::from(red) * 100 > u32::from(green.max(blue)) * WARM_PERCENT);
    }
    let has_colour = coloured as f64 > COLOURED_SHARE_MIN * lit as f64;
    has_colour.then(|| warm as f64 / lit as f64)
}

/// Mean squared Laplacian over mean squared level, which does not change with exposure.
fn sharpness(picture: &Gray) -> f64 {
    let (mut laplacian_energy, mut energy) = (0_u64, 1_u64);
    for y in 1..picture.height().saturating_sub(1) {
        let (above, row, below) = (picture.row(y - 1), picture.row(y), picture.row(y + 1));
        for x in 1..row.len().saturating_sub(1) {
            let level = i64::from(row[x]);
            let around = [row[x - 1], row[x + 1], above[x], below[x]].map(i64::from).iter().sum::<i64>();
            laplacian_energy += (4 * level - around).unsigned_abs().pow(2);
            energy += level.unsigned_abs().pow(2);
        }
    }
    laplacian_energy as f64 / energy as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate() -> QualityGate {
        QualityGate::new(&QualityConfig {
            dark_level: 12,
            dark_share_max: 0.97,
            tissue_share_min: 0.3,
            out_of_body_pictures: 3,
            sharpness_ratio_min: 0.25,
            sharpness_window: 15,
        })
    }

    /// The verdict of a monochrome camera's picture.
    fn assess(gate: &mut QualityGate, picture: &Gray) -> FrameQuality {
        gate.assess(picture, &tinted(picture, [100, 100, 100]))
    }

    fn tinted(picture: &Gray, percent: [u32; 3]) -> Rgb {
        let tint = |x, y| {
            let level = u32::from(picture.row(y)[x as usize]);
            percent.map(|percent| (level * percent / 100).min(255) as u8)
        };
        Rgb::from_fn(picture.width(), picture.height(), tint)
    }

    fn stripes(offset: u32, period: u32) -> Gray {
        Gray::from_fn(64, 48, |x, _| if ((x + offset) / period).is_multiple_of(2) { 60 } else { 180 })
    }

    #[test]
    fn a_black_picture_is_black_even_when_it_repeats() {
        let (mut gate, black) = (gate(), Gray::filled(64, 48, 3));
        assert_eq!(assess(&mut gate, &black), FrameQuality::Black);
        assert_eq!(assess(&mut gate, &black), FrameQuality::Black);
    }

    #[test]
    fn an_identical_picture_is_frozen_and_the_next_different_one_is_good() {
        let mut gate = gate();
        assert_eq!(assess(&mut gate, &stripes(0, 4)), FrameQuality::Good);
        assert_eq!(assess(&mut gate, &stripes(0, 4)), FrameQuality::Frozen);
        assert_eq!(assess(&mut gate, &stripes(1, 4)), FrameQuality::Good);
    }

    #[test]
    fn a_scope_outside_the_body_is_noticed_after_a_few_pictures_and_forgotten_at_the_first_tissue() {
        let mut gate = gate();
        let verdict = |gate: &mut QualityGate, offset, percent| {
            let picture = stripes(offset, 2);
            gate.assess(&picture, &tinted(&picture, percent))
        };
        let (tissue, drape) = ([120, 60, 50], [70, 110, 100]);
        assert_eq!(verdict(&mut gate, 0, tissue), FrameQuality::Good);
        let outside: Vec<_> = (1..5).map(|offset| verdict(&mut gate, offset, drape)).collect();
        let (good, out) = (FrameQuality::Good, FrameQuality::OutOfBody);
        assert_eq!(outside, [good, good, out, out]);
        assert_eq!(verdict(&mut gate, 5, tissue), FrameQuality::Good);
    }

    #[test]
    fn a_monochrome_camera_is_never_outside_the_body() {
        let mut gate = gate();
        assert!((0..9).all(|offset| assess(&mut gate, &stripes(offset, 2)) == FrameQuality::Good));
    }

    #[test]
    fn a_sudden_loss_of_sharpness_is_blur_until_it_proves_to_be_the_scene() {
        let mut gate = gate();
        for offset in 0..10 {
            assert_eq!(assess(&mut gate, &stripes(offset, 2)), FrameQuality::Good);
        }
        let verdicts: Vec<_> = (0..20).map(|offset| assess(&mut gate, &stripes(offset, 24))).collect();
        assert_eq!(verdicts[0], FrameQuality::Blurred);
        assert_eq!(verdicts[19], FrameQuality::Good);
    }

    #[test]
    fn a_picture_without_pixels_is_judged_without_panic() {
        assert_eq!(assess(&mut gate(), &Gray::filled(0, 0, 0)), FrameQuality::Good);
    }
}
