//! Motion blur: each pixel averages the light along its own path during the exposure.
//!
//! Symmetric about the middle of the exposure, so the blurred picture stays registered with pose and depth.

use geometry::Raster;
use nalgebra::Vector2;
use rayon::prelude::*;

use super::Radiance;
use crate::texture::Colour;

/// Motion below this is sharp.
const LEAST_PX: f32 = 0.35;
const TAPS_PER_PX: f32 = 1.3;
const TAPS_MAX: f32 = 48.0;

/// Blurs each pixel along its motion in pixels per exposure.
pub(super) fn blur(sharp: Radiance, motion_px: &Raster<Vector2<f32>>) -> Radiance {
    let moves = |motion: &Vector2<f32>| motion.norm_squared() > LEAST_PX * LEAST_PX;
    if !motion_px.pixels().iter().any(moves) {
        return sharp;
    }
    let (width, height) = sharp.size();
    let rows = (0..height).into_par_iter().flat_map_iter(|y| (0..width).map(move |x| (x, y)));
    let blurred = rows.map(|(x, y)| average_along(&sharp, x, y, motion_px[(x, y)])).collect();
    Radiance::from_vec(width, height, blurred).expect("one value for each pixel")
}

fn average_along(sharp: &Radiance, x: u32, y: u32, motion: Vector2<f32>) -> Colour {
    let taps = (motion.norm() * TAPS_PER_PX).ceil().clamp(1.0, TAPS_MAX);
    let tap = |k: usize| {
        let share = (k as f32 + 0.5) / taps - 0.5;
        bilinear(sharp, x as f32 + share * motion.x, y as f32 + share * motion.y)
    };
    (0..taps as usize).map(tap).sum::<Colour>() / taps
}

/// Light between pixels; beyond the border the border's own.
fn bilinear(picture: &Radiance, x: f32, y: f32) -> Colour {
    let (width, height) = picture.size();
    let x = x.clamp(0.0, width as f32 - 1.001);
    let y = y.clamp(0.0, height as f32 - 1.001);
    let (x0, y0) = (x as u32, y as u32);
    let (tx, ty) = (x - x0 as f32, y - y0 as f32);
    let top = picture[(x0, y0)].lerp(&picture[(x0 + 1, y0)], tx);
    let bottom = picture[(x0, y0 + 1)].lerp(&picture[(x0 + 1, y0 + 1)], tx);
    top.lerp(&bottom, ty)
}
