//! From a recording to the wire.

use geometry::{CameraModel, Pinhole, StereoCalibration, StereoRig};
use protocol::v1;
use recording::{Calibration, EncodedImage, ImageFormat, RawPixel, RecordingError, StereoMessage};

/// A calibration on the wire.
pub fn calibration(calibration: &Calibration) -> v1::Calibration {
    match calibration {
        Calibration::Rectified(rig) => v1::Calibration { rectified: Some(rectified(rig)), raw: None },
        Calibration::Raw(cameras) => v1::Calibration { rectified: None, raw: Some(raw(cameras)) },
    }
}

fn rectified(rig: &StereoRig) -> v1::RectifiedRig {
    v1::RectifiedRig {
        left: Some(camera(&rig.left)),
        baseline_m: rig.baseline_m,
        right_cx_px: rig.right_cx_px,
    }
}

fn raw(cameras: &StereoCalibration) -> v1::RawRig {
    let motion = &cameras.right_from_left;
    let (t, q) = (&motion.translation, &motion.rotation);
    v1::RawRig {
        left: Some(distorted(&cameras.left)),
        right: Some(distorted(&cameras.right)),
        right_from_left: Some(v1::RigidTransform {
            tx_m: t.x,
            ty_m: t.y,
            tz_m: t.z,
            qx: q.i,
            qy: q.j,
            qz: q.k,
            qw: q.w,
        }),
    }
}

fn distorted(model: &CameraModel) -> v1::DistortedCamera {
    v1::DistortedCamera {
        camera: Some(camera(&model.pinhole)),
        distortion: model.distortion.coefficients().to_vec(),
    }
}

fn camera(pinhole: &Pinhole) -> v1::Camera {
    v1::Camera {
        width_px: pinhole.width_px,
        height_px: pinhole.height_px,
        fx_px: pinhole.fx_px,
        fy_px: pinhole.fy_px,
        cx_px: pinhole.cx_px,
        cy_px: pinhole.cy_px,
    }
}

/// How images travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As JPEG: those that are go as they are, others are encoded with this quality.
    Jpeg {
        /// 1 to 100.
        quality: u8,
    },
    /// As pixels: on one machine, where decoding costs more than copying.
    Raw,
    /// As they are in the recording.
    Unchanged,
}

/// A pair on the wire. Damaged images go out as they are, and as of `size_px`: the server refuses and counts them.
///
/// # Errors
/// [`RecordingError`] for a raw image that cannot be repacked.
pub fn pair(
    message: StereoMessage,
    sequence: u64,
    (size_px, encoding): ((u32, u32), Encoding),
) -> Result<v1::StereoPair, RecordingError> {
    let eye = |image| encoded(image, size_px, encoding);
    Ok(v1::StereoPair {
        stamp_ns: message.stamp_ns,
        sequence,
        left: Some(eye(message.left)?),
        right: Some(eye(message.right)?),
        mask: message.mask.map(|mask| image_to_wire(mask, size_px)).transpose()?,
    })
}

fn encoded(
    given: EncodedImage,
    size_px: (u32, u32),
    encoding: Encoding,
) -> Result<v1::EncodedImage, RecordingError> {
    let wanted = match encoding {
        Encoding::Jpeg { .. } => given.format != ImageFormat::Jpeg,
        Encoding::Raw => !matches!(given.format, ImageFormat::Raw { .. }),
        Encoding::Unchanged => false,
    };
    let Some(pixels) = wanted.then(|| recording::decode_rgb(&given, size_px).ok()).flatten() else {
        return image_to_wire(given, size_px);
    };
    if let Encoding::Jpeg { quality } = encoding {
        return image_to_wire(recording::encode_jpeg(&pixels, quality)?, size_px);
    }
    let ((width_px, height_px), data) = (pixels.size(), pixels.into_vec().into_flattened().into());
    Ok(v1::EncodedImage { format: v1::ImageFormat::Rgb8.into(), width_px, height_px, data })
}

/// An image on the wire, of `size_px` where its own header does not tell. The wire knows raw images only without padding and
/// as RGB or grey.
///
/// # Errors
/// [`RecordingError`] for a raw image that is not of its own size.
pub fn image_to_wire(image: EncodedImage, size_px: (u32, u32)) -> Result<v1::EncodedImage, RecordingError> {
    let (width_px, height_px) = recording::size_px(&image).unwrap_or(size_px);
    let (format, data) = match image.format {
        ImageFormat::Jpeg => (v1::ImageFormat::Jpeg, image.bytes),
        ImageFormat::Png => (v1::ImageFormat::Png, image.bytes),
        ImageFormat::Raw { width, height, pixel: RawPixel::Mono8, .. } => {
            (v1::ImageFormat::Gray8, recording::decode_gray(&image, (width, height))?.into_vec())
        }
        ImageFormat::Raw { width, height, .. } => (
            v1::ImageFormat::Rgb8,
            recording::decode_rgb(&image, (width, height))?.into_vec().into_flattened(),
        ),
    };
    Ok(v1::EncodedImage { format: format.into(), width_px, height_px, data: data.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padded_blue_green_red_rows_become_plain_rgb() {
        let format = ImageFormat::Raw { width: 1, height: 2, row_bytes: 4, pixel: RawPixel::Bgr8 };
        let sent =
            image_to_wire(EncodedImage { format, bytes: vec![3, 2, 1, 0, 6, 5, 4, 0] }, (1, 2)).unwrap();
        assert_eq!((sent.format(), &sent.data[..]), (v1::ImageFormat::Rgb8, &[1, 2, 3, 4, 5, 6][..]));
        assert_eq!((sent.width_px, sent.height_px), (1, 2));
    }

    #[test]
    fn images_travel_in_the_encoding_that_was_chosen() {
        let picture = geometry::Rgb::from_fn(16, 12, |x, y| [x as u8 * 9, y as u8 * 9, 50]);
        let (png, jpeg) =
            (recording::encode_png_rgb(&picture).unwrap(), recording::encode_jpeg(&picture, 90).unwrap());
        let format =
            |given: &EncodedImage, encoding| encoded(given.clone(), (16, 12), encoding).unwrap().format();
        let as_jpeg = Encoding::Jpeg { quality: 90 };
        assert_eq!(
            (format(&png, as_jpeg), format(&jpeg, as_jpeg)),
            (v1::ImageFormat::Jpeg, v1::ImageFormat::Jpeg)
        );
        assert_eq!(encoded(jpeg.clone(), (16, 12), as_jpeg).unwrap().data, jpeg.bytes, "no second loss");
        assert_eq!(format(&png, Encoding::Unchanged), v1::ImageFormat::Png);
        let raw = encoded(png, (16, 12), Encoding::Raw).unwrap();
        assert_eq!((raw.format(), &raw.data[..3]), (v1::ImageFormat::Rgb8, &picture.pixels()[0][..]));
    }

    #[test]
    fn a_damaged_jpeg_is_sent_as_it_is() {
        let sent = image_to_wire(
            EncodedImage { format: ImageFormat::Jpeg, bytes: vec![0xFF, 0xD8, 0x00] },
            (64, 48),
        )
        .unwrap();
        assert_eq!((sent.width_px, sent.height_px, sent.data.len()), (64, 48, 3));
    }
}
