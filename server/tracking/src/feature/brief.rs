//! Rotated BRIEF: 256 brightness comparisons, steered by the corner's orientation.
//!
//! The pairs are drawn once from an isotropic Gaussian of sigma = patch / 5, the best of the layouts in Calonder et
//! al. 2010 (section 3.2, "G II"), by a seeded generator, so every build compares the same pairs. As in ORB (Rublee et al. 2011,
//! section 4.1) the pattern is rotated beforehand to a fixed set of angles.

use std::sync::LazyLock;

use geometry::Gray;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

const PAIRS: usize = 256;
const STEERING_ANGLES: usize = 64;
const PATCH_PX: f32 = 31.0;
/// Offsets stay within this radius, so that a rotated one is at most 16 px off.
const RADIUS_PX: f32 = 15.0;
const PATTERN_SEED: u128 = 0x0b71_ef00_5eed;

/// 256 comparison bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Descriptor(pub [u64; 4]);

impl Descriptor {
    /// Number of differing bits, 0 to 256.
    #[inline(always)]
    pub fn distance(&self, other: &Self) -> u32 {
        let bits = |i: usize| (self.0[i] ^ other.0[i]).count_ones();
        bits(0) + bits(1) + bits(2) + bits(3)
    }
}

/// `(dx, dy)` of both ends of each comparison.
type Pattern = [[(i8, i8); 2]; PAIRS];

/// Rotated offsets reach this far.
const REACH_PX: usize = 16;
/// Pixels of a patch, and its rows apart by a power of two.
const PATCH_ROW: usize = 2 * REACH_PX + 1;
const PATCH_STRIDE: usize = 64;
const PATCH_LENGTH: usize = 4096;

static STEERED: LazyLock<Vec<Pattern>> = LazyLock::new(|| {
    let upright = upright_pattern();
    let angle = |step: usize| step as f32 * std::f32::consts::TAU / STEERING_ANGLES as f32;
    (0..STEERING_ANGLES).map(|step| rotated(&upright, angle(step))).collect()
});

/// The same as places in a patch.
static STEERED_PLACES: LazyLock<Vec<[[u16; 2]; PAIRS]>> = LazyLock::new(|| {
    let along = |offset: i8| (REACH_PX as i32 + i32::from(offset)) as usize;
    let place = |(dx, dy): (i8, i8)| (along(dy) * PATCH_STRIDE + along(dx)) as u16;
    STEERED.iter().map(|pattern| pattern.map(|pair| pair.map(place))).collect()
});

/// Describes the patch around `(x, y)`, at least 16 px inside a smoothed image.
pub fn describe(smoothed: &Gray, x: u32, y: u32, angle_rad: f32) -> Descriptor {
    let step = (angle_rad * (STEERING_ANGLES as f32 / std::f32::consts::TAU)).round() as i32;
    let places = &STEERED_PLACES[step.rem_euclid(STEERING_ANGLES as i32) as usize];
    let patch = cut_patch(smoothed, x as usize, y as usize);
    // places are below the patch's length: the remainder changes nothing but spares the check
    let value = |place: u16| patch[usize::from(place) % PATCH_LENGTH];
    let mut words = [0; 4];
    for (word, pairs) in words.iter_mut().zip(places.chunks_exact(64)) {
        for (bit, [first, second]) in pairs.iter().enumerate() {
            *word |= u64::from(value(*first) < value(*second)) << bit;
        }
    }
    Descriptor(words)
}

fn cut_patch(image: &Gray, x: usize, y: usize) -> [u8; PATCH_LENGTH] {
    let mut patch = [0; PATCH_LENGTH];
    let rows = patch.chunks_exact_mut(PATCH_STRIDE).take(PATCH_ROW);
    for (offset, row) in rows.enumerate() {
        let source = &image.row((y + offset - REACH_PX) as u32)[x - REACH_PX..][..PATCH_ROW];
        row[..PATCH_ROW].copy_from_slice(source);
    }
    patch
}

fn upright_pattern() -> Vec<[(f32, f32); 2]> {
    let mut random = Pcg64Mcg::new(PATTERN_SEED);
    (0..PAIRS).map(|_| [gaussian_offset(&mut random), gaussian_offset(&mut random)]).collect()
}

/// A Gaussian offset (Box-Muller), drawn again until it is inside the disc.
fn gaussian_offset(random: &mut Pcg64Mcg) -> (f32, f32) {
    loop {
        let radius = PATCH_PX / 5.0 * (-2.0 * random.random_range(f32::EPSILON..1.0).ln()).sqrt();
        let (sin, cos) = random.random_range(0.0..std::f32::consts::TAU).sin_cos();
        if radius <= RADIUS_PX {
            return (radius * cos, radius * sin);
        }
    }
}

fn rotated(upright: &[[(f32, f32); 2]], angle_rad: f32) -> Pattern {
    let (sin, cos) = angle_rad.sin_cos();
    let turn = |(x, y): (f32, f32)| ((x * cos - y * sin).round() as i8, (x * sin + y * cos).round() as i8);
    std::array::from_fn(|pair| upright[pair].map(turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feature::{orientation, smooth};
    use geometry::Raster;

    /// A smooth random texture around the middle of a 61x61 image, turned by an angle.
    fn turned_texture(seed: u128, angle_rad: f32) -> Gray {
        let mut random = Pcg64Mcg::new(seed);
        let waves: Vec<[f32; 3]> = (0..24)
            .map(|_| [(); 3].map(|()| random.random_range(-1.0..1.0)))
            .map(|[a, b, c]: [f32; 3]| [a * 0.7, b * 0.7, c * 3.1])
            .collect();
        let (sin, cos) = angle_rad.sin_cos();
        Raster::from_fn(61, 61, |x, y| {
            let (dx, dy) = (x as f32 - 30.0, y as f32 - 30.0);
            let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let sum: f32 = waves.iter().map(|[a, b, c]| (a * u + b * v + c).sin()).sum();
            (128.0 + 1.2 * u + 9.0 * sum).clamp(0.0, 255.0) as u8
        })
    }

    fn describe_middle(image: &Gray) -> Descriptor {
        describe(&smooth::gaussian_7x7(image), 30, 30, orientation::angle_rad(image, 30, 30))
    }

    #[test]
    fn a_turned_patch_keeps_its_descriptor() {
        for seed in 0..10 {
            let upright = describe_middle(&turned_texture(seed, 0.0));
            for degrees in [10.0_f32, 45.0, 90.0, 133.0, 180.0, 271.0] {
                let turned = describe_middle(&turned_texture(seed, degrees.to_radians()));
                let distance = upright.distance(&turned);
                assert!(distance < 50, "{distance} bits differ at {degrees} degrees, seed {seed}");
            }
        }
    }

    #[test]
    fn different_patches_differ_in_many_bits() {
        for seed in 0..10 {
            let distance = describe_middle(&turned_texture(seed, 0.0))
                .distance(&describe_middle(&turned_texture(seed + 100, 0.0)));
            assert!(distance > 70, "{distance} bits differ, seed {seed}");
        }
    }

    #[test]
    fn descriptors_are_the_comparisons_of_the_pattern() {
        let mut random = Pcg64Mcg::new(23);
        let image = Raster::from_fn(50, 40, |_, _| random.random_range(0_u8..=255));
        for (x, y, step) in [(16, 16, 0), (33, 23, 17), (20, 20, 63)] {
            let angle_rad = step as f32 * std::f32::consts::TAU / STEERING_ANGLES as f32;
            let Descriptor(words) = describe(&image, x, y, angle_rad);
            for (bit, ends) in STEERED[step].iter().enumerate() {
                let [first, second] = ends.map(|(dx, dy)| {
                    *image.get(i64::from(x) + i64::from(dx), i64::from(y) + i64::from(dy)).expect("inside")
                });
                assert_eq!(words[bit / 64] >> (bit % 64) & 1, u64::from(first < second), "bit {bit}");
            }
        }
    }

    #[test]
    fn the_pattern_stays_inside_the_keypoint_border() {
        let reach = STEERED.iter().flatten().flatten().map(|&(x, y)| x.abs().max(y.abs())).max();
        assert!(reach.is_some_and(|reach| u32::from(reach.unsigned_abs()) < crate::feature::BORDER_PX));
    }

    #[test]
    fn distance_counts_differing_bits() {
        let zero = Descriptor([0; 4]);
        assert_eq!(zero.distance(&Descriptor([u64::MAX; 4])), 256);
        assert_eq!(zero.distance(&Descriptor([1, 2, 4, 8])), 4);
    }
}
