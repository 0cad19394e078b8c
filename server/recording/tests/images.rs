//! Decoding and encoding images, good and hostile.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use common::{HEIGHT, WIDTH, jpeg, picture, raw_image};
use geometry::Raster;
use image::{DynamicImage, ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use proptest::prelude::*;
use recording::{
    EncodedImage, ImageFormat, RawPixel, RecordingError, decode_gray, decode_rgb, encode_png_gray,
    encode_png_rgb, size_px,
};

const SIZE: (u32, u32) = (WIDTH, HEIGHT);

fn png_of(image: &DynamicImage) -> EncodedImage {
    let mut bytes = Vec::new();
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    EncodedImage { format: ImageFormat::Png, bytes }
}

fn dynamic() -> DynamicImage {
    let bytes = picture(3).pixels().as_flattened().to_vec();
    DynamicImage::from(image::RgbImage::from_raw(WIDTH, HEIGHT, bytes).unwrap())
}

#[test]
fn a_png_comes_back_as_it_was() {
    let original = picture(3);
    let encoded = encode_png_rgb(&original).unwrap();
    assert_eq!(decode_rgb(&encoded, SIZE).unwrap(), original);
    assert_eq!(decode_gray(&encoded, SIZE).unwrap(), original.to_gray());
}

#[test]
fn a_grey_png_is_luminance_as_it_is() {
    let gray = picture(5).to_gray();
    let encoded = encode_png_gray(&gray).unwrap();
    assert_eq!(decode_gray(&encoded, SIZE).unwrap(), gray);
    assert_eq!(decode_rgb(&encoded, SIZE).unwrap(), gray.map(|&value| [value; 3]));
}

#[test]
fn a_jpeg_of_a_smooth_picture_is_close_to_it() {
    let smooth = Raster::from_fn(WIDTH, HEIGHT, |x, y| [(4 * x) as u8, (5 * y) as u8, 100]);
    let decoded = decode_rgb(&recording::encode_jpeg(&smooth, 95).unwrap(), SIZE).unwrap();
    let worst = smooth.pixels().as_flattened().iter().zip(decoded.pixels().as_flattened());
    let worst = worst.map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    // Measured: 3 grey levels.
    assert!(worst <= 6, "{worst}");
}

#[test]
fn sixteen_bits_and_alpha_become_eight_bits_without_alpha() {
    for image in [
        DynamicImage::from(dynamic().to_rgba8()),
        DynamicImage::from(dynamic().to_rgb16()),
        DynamicImage::from(dynamic().to_rgba16()),
    ] {
        assert_eq!(decode_rgb(&png_of(&image), SIZE).unwrap(), picture(3), "{:?}", image.color());
    }
    let gray = DynamicImage::from(dynamic().to_luma8());
    let wide = DynamicImage::from(gray.to_luma16());
    assert_eq!(decode_gray(&png_of(&wide), SIZE).unwrap(), decode_gray(&png_of(&gray), SIZE).unwrap());
}

#[test]
fn a_palette_png_is_expanded() {
    // 2x1, two colours of one bit each, made by hand: the encoder used here writes no palettes.
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let chunks: [(&[u8; 4], &[u8]); 4] = [
        (b"IHDR", &[0, 0, 0, 2, 0, 0, 0, 1, 1, 3, 0, 0, 0]),
        (b"PLTE", &[10, 20, 30, 200, 100, 50]),
        (b"IDAT", &[0x78, 0x01, 0x01, 2, 0, 0xfd, 0xff, 0, 0x40, 0x00, 0x42, 0x00, 0x41]),
        (b"IEND", &[]),
    ];
    for (kind, body) in chunks {
        bytes.extend((body.len() as u32).to_be_bytes());
        bytes.extend(kind);
        bytes.extend(body);
        bytes.extend(crc32(&[kind.as_slice(), body].concat()).to_be_bytes());
    }
    let image = EncodedImage { format: ImageFormat::Png, bytes };
    assert_eq!(decode_rgb(&image, (2, 1)).unwrap().pixels(), [[10, 20, 30], [200, 100, 50]]);
}

#[test]
fn raw_rows_may_be_padded_and_in_either_colour_order() {
    let bytes = vec![1, 2, 3, 4, 5, 6, 99, 7, 8, 9, 10, 11, 12];
    let format = |pixel| ImageFormat::Raw { width: 2, height: 2, row_bytes: 7, pixel };
    let rgb = EncodedImage { format: format(RawPixel::Rgb8), bytes: bytes.clone() };
    assert_eq!(decode_rgb(&rgb, (2, 2)).unwrap().pixels(), [[1, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12]]);
    let bgr = EncodedImage { format: format(RawPixel::Bgr8), bytes };
    assert_eq!(decode_rgb(&bgr, (2, 2)).unwrap().pixels()[0], [3, 2, 1]);
    let mono = raw_image(2, 1, RawPixel::Mono8, vec![5, 6]);
    assert_eq!(decode_gray(&mono, (2, 1)).unwrap().pixels(), [5, 6]);
}

#[test]
fn raw_rows_that_do_not_fit_their_bytes_are_refused() {
    for (width, height, row_bytes, bytes) in
        [(2, 2, 6, 11), (2, 2, 5, 100), (2, 2, u32::MAX, 100), (0, 2, 6, 12), (2, 0, 6, 12)]
    {
        let format = ImageFormat::Raw { width, height, row_bytes, pixel: RawPixel::Rgb8 };
        let image = EncodedImage { format, bytes: vec![0; bytes] };
        let error = decode_rgb(&image, (width, height)).unwrap_err();
        assert!(matches!(error, RecordingError::ImageData { .. }), "{error}");
    }
}

/// A PNG of `side` by `side` pixels that is a few hundred bytes long.
fn png_bomb(side: u32) -> EncodedImage {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(&[0], 1, 1, ExtendedColorType::L8).unwrap();
    let header = 16;
    bytes[header..header + 4].copy_from_slice(&side.to_be_bytes());
    bytes[header + 4..header + 8].copy_from_slice(&side.to_be_bytes());
    let crc = crc32(&bytes[header - 4..header + 13]);
    bytes[header + 13..header + 17].copy_from_slice(&crc.to_be_bytes());
    EncodedImage { format: ImageFormat::Png, bytes }
}

/// A JPEG whose header claims `side` by `side` pixels.
fn jpeg_bomb(side: u16) -> EncodedImage {
    let mut image = jpeg(1);
    let frame = image.bytes.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    image.bytes[frame + 5..frame + 7].copy_from_slice(&side.to_be_bytes());
    image.bytes[frame + 7..frame + 9].copy_from_slice(&side.to_be_bytes());
    image
}

/// The checksum of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0_u32;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        }
    }
    !crc
}

#[test]
fn an_image_bomb_is_refused_by_its_header() {
    for bomb in [png_bomb(30_000), jpeg_bomb(30_000)] {
        assert!(bomb.bytes.len() < 4000);
        assert_eq!(size_px(&bomb).unwrap(), (30_000, 30_000));
        for error in [decode_rgb(&bomb, SIZE).unwrap_err(), decode_gray(&bomb, SIZE).unwrap_err()] {
            assert!(matches!(error, RecordingError::ImageSize { got: (30_000, 30_000), .. }), "{error}");
        }
    }
}

#[test]
fn an_image_cut_short_anywhere_is_damaged_or_of_another_size() {
    for image in [jpeg(1), encode_png_rgb(&picture(1)).unwrap()] {
        // A PNG's last twelve bytes say only that it ends.
        let needed =
            if image.format == ImageFormat::Png { image.bytes.len() - 12 } else { image.bytes.len() };
        for length in 0..needed {
            let cut = EncodedImage { format: image.format, bytes: image.bytes[..length].to_vec() };
            let error = decode_rgb(&cut, SIZE).expect_err(&format!("{length} of {}", image.bytes.len()));
            assert!(matches!(error, RecordingError::ImageData { .. } | RecordingError::ImageSize { .. }));
        }
    }
}

#[test]
fn garbage_behind_a_jpeg_does_no_harm() {
    let mut image = jpeg(1);
    let clean = decode_rgb(&image, SIZE).unwrap();
    image.bytes.extend([0; 64]);
    assert_eq!(decode_rgb(&image, SIZE).unwrap(), clean);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn garbage_is_an_error_never_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), is_png: bool) {
        let format = if is_png { ImageFormat::Png } else { ImageFormat::Jpeg };
        let image = EncodedImage { format, bytes };
        prop_assert!(decode_rgb(&image, SIZE).is_err());
    }

    #[test]
    fn flipped_bits_never_panic(at in 0_usize..2000, bit in 0_u8..8, is_png: bool) {
        let mut image = if is_png { encode_png_rgb(&picture(2)).unwrap() } else { jpeg(2) };
        let at = at % image.bytes.len();
        image.bytes[at] ^= 1_u8 << bit;
        if let Ok(decoded) = decode_rgb(&image, SIZE) {
            prop_assert_eq!(decoded.size(), SIZE);
        }
    }
}

#[test]
fn a_picture_of_a_4k_endoscope_decodes() {
    let noise = |x: u32, y: u32| (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503)).to_le_bytes();
    let large = Raster::from_fn(3840, 2160, |x, y| {
        let [_, r, g, b] = noise(x, y);
        [r, g, b]
    });
    assert_eq!(decode_rgb(&encode_png_rgb(&large).unwrap(), (3840, 2160)).unwrap(), large);
    let jpeg = recording::encode_jpeg(&large, 80).unwrap();
    assert_eq!(decode_gray(&jpeg, (3840, 2160)).unwrap().size(), (3840, 2160));
}
