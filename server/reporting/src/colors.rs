//! Values as colours.

use geometry::{DepthMap, Raster, Rgb};

/// What is not known.
const UNKNOWN: [u8; 3] = [0x15, 0x18, 0x1c];

/// Depth from near (bright) to far (dark).
pub(crate) fn of_depth(depth: &DepthMap, [near_m, far_m]: [f64; 2]) -> Rgb {
    depth.map(|&depth_m| {
        if !is_known(depth_m) {
            return UNKNOWN;
        }
        let share = (f64::from(depth_m) - near_m) / (far_m - near_m).max(1e-9);
        of(colorous::VIRIDIS, 1.0 - share)
    })
}

/// Signed differences: blue below, red above, white where there is none.
pub(crate) fn of_difference(difference_m: &Raster<f32>, most_m: f64) -> Rgb {
    difference_m.map(|&difference_m| {
        if !difference_m.is_finite() {
            return UNKNOWN;
        }
        of(colorous::RED_BLUE, 0.5 - f64::from(difference_m) / (2.0 * most_m))
    })
}

/// A distance, from none (dark) to `most_m` and beyond (bright).
pub(crate) fn of_distance(distance_m: f64, most_m: f64) -> [u8; 3] {
    of(colorous::PLASMA, 0.15 + 0.85 * distance_m / most_m)
}

/// Whether a depth map says something there.
pub(crate) fn is_known(depth_m: f32) -> bool {
    depth_m.is_finite() && depth_m > 0.0
}

/// What pictures without an image are drawn on.
pub(crate) fn background(width_px: u32, height_px: u32) -> Rgb {
    Raster::filled(width_px, height_px, UNKNOWN)
}

fn of(scale: colorous::Gradient, share: f64) -> [u8; 3] {
    scale.eval_continuous(share.clamp(0.0, 1.0)).into_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unknown_has_a_colour_of_its_own() {
        let depth = DepthMap::from_fn(3, 1, |x, _| [0.0, f32::NAN, 0.05][x as usize]);
        let colored = of_depth(&depth, [0.0, 0.1]);
        assert_eq!(colored.pixels()[..2], [UNKNOWN; 2]);
        assert_ne!(colored.pixels()[2], UNKNOWN);
    }

    #[test]
    fn no_difference_is_pale_and_signs_differ() {
        let difference = Raster::from_fn(3, 1, |x, _| [-1.0_f32, 0.0, 1.0][x as usize]);
        let [below, none, above] = of_difference(&difference, 1.0).pixels().try_into().unwrap();
        assert!(none.iter().all(|&channel| channel > 230), "{none:?}");
        assert!(below[2] > below[0] && above[0] > above[2], "{below:?} {above:?}");
    }
}
