//! Exposure, vignette, sensor noise and display encoding.

use geometry::Rgb;
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::Radiance;
use crate::SceneConfig;
use crate::texture::{encode_srgb, luminance};

/// The auto-exposure brings the median of the left picture here (linear; sRGB 100) ...
const MEDIAN_TARGET: f32 = 0.125;
/// ... unless that would push the 90th percentile over this.
const BRIGHT_LIMIT: f32 = 0.50;
/// Above this linear light is compressed, not clipped.
const SHOULDER: f32 = 0.70;
const METERING_STRIDE: usize = 7;
const GAUSSIAN_TABLE: usize = 1 << 16;
const CURVE_STEPS: usize = 4096;

/// Turns light into 8-bit pictures.
pub(crate) struct Sensor {
    vignette: f32,
    /// Electrons of white and of the read noise; `None` without noise.
    noise_electrons: Option<[f32; 2]>,
    gaussian: Vec<f32>,
    /// 8-bit value (with fraction) by linear light 0 to 1.
    curve: Vec<f32>,
}

/// The gain that exposes a picture well.
pub(crate) fn exposure_gain(picture: &Radiance) -> f32 {
    let metered = picture.pixels().iter().step_by(METERING_STRIDE).map(luminance);
    let mut sorted: Vec<f32> = metered.filter(|&light| light > 0.0).collect();
    if sorted.is_empty() {
        return 1.0;
    }
    sorted.sort_unstable_by(f32::total_cmp);
    let quantile = |share: f32| sorted[((sorted.len() - 1) as f32 * share) as usize].max(1e-6);
    (MEDIAN_TARGET / quantile(0.5)).min(BRIGHT_LIMIT / quantile(0.9))
}

impl Sensor {
    pub fn new(config: &SceneConfig) -> Self {
        let mut random = Pcg64::seed_from_u64(config.seed ^ 0x0005_e450);
        let electrons = [config.full_well_electrons as f32, config.read_noise_electrons as f32];
        Self {
            vignette: config.vignette as f32,
            noise_electrons: config.noise.then_some(electrons),
            gaussian: (0..GAUSSIAN_TABLE).map(|_| gaussian(&mut random)).collect(),
            curve: (0..=CURVE_STEPS).map(|step| displayed(step as f32 / CURVE_STEPS as f32)).collect(),
        }
    }

    /// The picture that the sensor delivers; `key` chooses the noise.
    pub fn expose(&self, light: &Radiance, gain: f32, key: u64) -> Rgb {
        let (width, height) = light.size();
        let size = Vector2::new(width as f32, height as f32);
        let pixels = light
            .pixels()
            .par_iter()
            .enumerate()
            .map(|(index, radiance)| {
                let (x, y) = (index % width as usize, index / width as usize);
                let off_centre = (Vector2::new(x as f32, y as f32) - size * 0.5).norm_squared();
                let share = off_centre / (0.25 * size.norm_squared());
                let gain = gain * (1.0 - self.vignette * share * (0.4 + 0.6 * share));
                let random = mixed(key.wrapping_add(index as u64));
                [0, 1, 2].map(|channel| {
                    let noisy = self.noisy(radiance[channel] * gain, random >> (16 * channel));
                    self.encode(noisy)
                })
            })
            .collect();
        Rgb::from_vec(width, height, pixels).expect("one value for each pixel")
    }

    /// Shot noise grows with the root of the light, read noise does not.
    fn noisy(&self, light: f32, random: u64) -> f32 {
        let Some([white, read]) = self.noise_electrons else { return light };
        let electrons = light.min(4.0) * white;
        let deviation = (electrons + read * read).sqrt();
        (electrons + deviation * self.gaussian[random as usize % GAUSSIAN_TABLE]) / white
    }

    fn encode(&self, linear: f32) -> u8 {
        let place = compress(linear).clamp(0.0, 1.0) * CURVE_STEPS as f32;
        let step = (place as usize).min(CURVE_STEPS - 1);
        let value = self.curve[step] + (self.curve[step + 1] - self.curve[step]) * (place - step as f32);
        (value + 0.5) as u8
    }
}

/// Linear up to the shoulder, then bending towards white at twice white's light.
fn compress(linear: f32) -> f32 {
    if linear <= SHOULDER {
        return linear;
    }
    let over = ((linear - SHOULDER) / (2.0 - SHOULDER)).min(1.0);
    SHOULDER + (1.0 - SHOULDER) * over * (2.0 - over)
}

fn displayed(linear: f32) -> f32 {
    255.0 * encode_srgb(linear)
}

/// Splitmix64's output function: independent bits for consecutive keys.
fn mixed(key: u64) -> u64 {
    let mut z = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Box and Muller's transform.
fn gaussian(random: &mut Pcg64) -> f32 {
    let radius = (-2.0 * random.random_range(f32::MIN_POSITIVE..1.0).ln()).sqrt();
    radius * (std::f32::consts::TAU * random.random_range(0.0_f32..1.0)).cos()
}
