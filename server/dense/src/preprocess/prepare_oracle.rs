//! CPU mirror of `prepare.wgsl`.

use geometry::{Mask, Raster, Rgb};
use gpu::{FrameRecorder, StageTimer};

use super::Preprocess;
use crate::disparity::DisparityConfig;
use crate::disparity::testing::{SIZES, config, hostile};
use crate::testing::gpu;

fn unusable([red, green, blue]: [u8; 3], grey: u8) -> bool {
    red.max(green).max(blue) <= 12 || grey >= 250
}

fn check(image: &Rgb, mask: &Mask) {
    let gpu = gpu();
    let config = DisparityConfig { mask_margin_px: 0, ..config() };
    assert_eq!((config.dark_level, config.saturated_level), (12, 250));
    let input = Preprocess::new(&gpu, image.size(), &config).unwrap();
    input.upload(&gpu, image, image, Some(mask)).unwrap();
    let timer = StageTimer::new(&gpu, 1).unwrap();
    let mut frame = FrameRecorder::begin(&gpu, &timer);
    input.record(&mut frame).unwrap();
    frame.submit().collect().unwrap();
    let luma = gpu.read(&input.left().luma).unwrap();
    let masked = gpu.read(&input.left().masked).unwrap();
    let unrounded = gpu.read(&input.left().grey).unwrap();
    for (value, &[red, green, blue]) in unrounded.into_iter().zip(image.pixels()) {
        let expected =
            (f64::from(red) * 4899.0 + f64::from(green) * 9617.0 + f64::from(blue) * 1868.0) / 16384.0;
        assert!((f64::from(value) - expected).abs() < 1e-3, "{value}, expected {expected}");
    }
    let grey = image.to_gray();
    let stride = image.width().next_multiple_of(4);
    for (index, (found, flag)) in bytemuck::cast_slice::<u32, u8>(&luma)
        .iter()
        .zip(bytemuck::cast_slice::<u32, u8>(&masked))
        .enumerate()
    {
        let at = ((index as u32 % stride).min(image.width() - 1), index as u32 / stride);
        assert_eq!(*found, grey[at], "{at:?}");
        assert_eq!(*flag, u8::from(unusable(image[at], grey[at]) || mask[at] != 0), "{at:?}");
    }
}

#[test]
fn grey_values_and_masks_equal_the_mirror_into_the_padding() {
    for size in SIZES {
        let [red, green, blue] = [1, 2, 3].map(|seed| hostile(size, seed));
        let image =
            Rgb::from_fn(size.0, size.1, |x, y| [&red, &green, &blue].map(|channel| channel[(x, y)][0]));
        check(&image, &Raster::from_fn(size.0, size.1, |x, y| u8::from(x * y % 7 == 3) * 200));
    }
}
