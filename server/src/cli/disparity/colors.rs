//! Values as colours: dark violet over green to yellow, black where unknown.

use geometry::{Raster, Rgb};

/// The picture of `values`, which `share` brings to 0 to 1; what is not finite is black.
pub(super) fn colored(values: &Raster<f32>, share: impl Fn(f32) -> f32) -> Rgb {
    values.map(|&value| {
        if !value.is_finite() {
            return [0; 3];
        }
        colorous::VIRIDIS.eval_continuous(f64::from(share(value).clamp(0.0, 1.0))).into_array()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_have_their_colours_and_the_unknown_is_black() {
        let values: Raster<f32> = Raster::from_fn(4, 1, |x, _| [0.0, 2.0, 9.0, f32::INFINITY][x as usize]);
        let picture = colored(&values, |value| value / 2.0);
        let [smallest, largest, beyond, unknown] = picture.pixels().try_into().unwrap();
        assert_eq!((largest, unknown), (beyond, [0; 3]));
        assert!(smallest[2] > smallest[1] && largest[1] > 200 && largest[2] < 80, "{smallest:?} {largest:?}");
    }
}
