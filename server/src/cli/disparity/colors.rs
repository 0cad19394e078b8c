//! Values as colours: dark violet over green to yellow, black where unknown.

use geometry::{Raster, Rgb};

/// Evenly spaced from the smallest value to the largest; lightness grows all the way.
const STOPS: [[f32; 3]; 5] =
    [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];

/// The picture of `values`, which `share` brings to 0 to 1; what is not finite is black.
pub(super) fn colored(values: &Raster<f32>, share: impl Fn(f32) -> f32) -> Rgb {
    let (width, height) = values.size();
    Raster::from_fn(width, height, |x, y| {
        let value = values[(x, y)];
        if value.is_finite() { color(share(value)) } else { [0; 3] }
    })
}

fn color(share: f32) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let start = (place as usize).min(STOPS.len() - 2);
    let part = place - start as f32;
    [0, 1, 2].map(|channel| {
        (STOPS[start][channel] * (1.0 - part) + STOPS[start + 1][channel] * part).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_have_their_colours_and_the_unknown_is_black() {
        let values: Raster<f32> = Raster::from_fn(4, 1, |x, _| [0.0, 2.0, 9.0, f32::INFINITY][x as usize]);
        let picture = colored(&values, |value| value / 2.0);
        assert_eq!(picture.pixels(), [[68, 1, 84], [253, 231, 37], [253, 231, 37], [0; 3]]);
    }
}
