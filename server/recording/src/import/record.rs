//! Recording a plan.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use geometry::{DepthMap, Raster};

use super::point_map::{self, RectifiedView};
use super::{
    DepthEncoding, DepthFile, Images, ImportRequest, ImportSummary, MaskFile, MaskMeaning, Plan,
    PlannedFrame, files,
};
use crate::encoded_image::decode_gray16;
use crate::{
    EncodedImage, RecordingConfig, RecordingError, RecordingWriter, decode_gray, decode_rgb, encode_png_gray,
    encoded_image::size_px,
};

/// Records into a file beside the one asked for, and renames it once it is complete.
pub(super) fn record(
    mut plan: Plan,
    request: &ImportRequest,
    config: &RecordingConfig,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<ImportSummary, RecordingError> {
    let (Some(first), Some(last)) = (plan.frames.first(), plan.frames.last()) else {
        return Err(RecordingError::input(request.source, "no stereo pairs"));
    };
    let unfinished = Unfinished::beside(request.recording);
    let mut writer = RecordingWriter::create(&unfinished.path, config)?;
    writer.write_metadata("import", origin(request))?;
    writer.write_calibration(first.stamp_ns, &plan.calibration)?;
    let size = plan.calibration.image_size_px();
    let view = RectifiedView::of(&plan.calibration)?;
    for (index, frame) in plan.frames.iter().enumerate() {
        let [left, right] = plan.images.pair(index, size, config.video_jpeg_quality)?;
        writer.write_pair(frame.stamp_ns, &left, &right)?;
        write_knowledge(&mut writer, frame, (size, &view))?;
        progress(index + 1, plan.frames.len());
    }
    writer.finish()?;
    unfinished.rename_to(request.recording)?;
    let count = |has: fn(&PlannedFrame) -> bool| plan.frames.iter().filter(|frame| has(frame)).count();
    Ok(ImportSummary {
        pairs: plan.frames.len(),
        first_stamp_ns: first.stamp_ns,
        last_stamp_ns: last.stamp_ns,
        masks: count(|frame| frame.mask.is_some()),
        depths: count(|frame| frame.depth.is_some()),
        poses: count(|frame| frame.world_from_camera.is_some()),
        calibration: plan.calibration,
    })
}

/// Where the recording comes from: names, not paths, which may tell of people.
pub(super) fn origin(request: &ImportRequest) -> BTreeMap<String, String> {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut values = BTreeMap::from([
        ("kind".to_owned(), request.kind.to_string()),
        ("source".to_owned(), name(request.source)),
    ]);
    if let Some(calibration) = request.calibration {
        values.insert("calibration".to_owned(), name(calibration));
    }
    values
}

impl Images {
    /// The pair of a frame; those of a video are had in their order only.
    fn pair(
        &mut self,
        index: usize,
        size_px: (u32, u32),
        jpeg_quality: u8,
    ) -> Result<[EncodedImage; 2], RecordingError> {
        match self {
            Self::Files(pairs) => {
                let [left, right] = &pairs[index];
                Ok([read_image(left, size_px)?, read_image(right, size_px)?])
            }
            Self::Video { video, numbers } => video.pair(numbers[index], jpeg_quality),
        }
    }
}

/// What is known of a frame beside its images.
fn write_knowledge(
    writer: &mut RecordingWriter,
    frame: &PlannedFrame,
    (size_px, view): ((u32, u32), &RectifiedView),
) -> Result<(), RecordingError> {
    let stamp_ns = frame.stamp_ns;
    if let Some(mask) = &frame.mask {
        writer.write_mask(stamp_ns, &read_mask(mask, size_px)?)?;
    }
    if let Some(depth) = &frame.depth {
        writer.write_truth_depth(stamp_ns, &read_depth(depth, size_px, view)?)?;
    }
    if let Some(world_from_camera) = frame.world_from_camera {
        writer.write_truth_pose(&StampedPose { stamp_ns, world_from_camera })?;
    }
    Ok(())
}

/// Reads an image file and checks its header against the calibration.
fn read_image(path: &Path, expected_px: (u32, u32)) -> Result<EncodedImage, RecordingError> {
    let format =
        files::image_format(path).ok_or_else(|| RecordingError::input(path, "neither JPEG nor PNG"))?;
    let bytes = std::fs::read(path).map_err(RecordingError::io(path))?;
    let image = EncodedImage { format, bytes };
    let got = size_px(&image).map_err(|error| RecordingError::input(path, error))?;
    if got != expected_px {
        let error = RecordingError::ImageSize { expected: expected_px, got };
        return Err(RecordingError::input(path, format!("{error}, the size of the calibration")));
    }
    Ok(image)
}

fn read_mask(file: &MaskFile, size_px: (u32, u32)) -> Result<EncodedImage, RecordingError> {
    if matches!(file.meaning, MaskMeaning::InstrumentIsBright) {
        return read_image(&file.path, size_px);
    }
    let own_px = files::image_size_px(&file.path)?;
    if own_px.0 > size_px.0 || own_px.1 > size_px.1 {
        let problem = format!("{}x{}, larger than the images", own_px.0, own_px.1);
        return Err(RecordingError::input(&file.path, problem));
    }
    let tissue = decode_gray(&read_image(&file.path, own_px)?, own_px)
        .map_err(|error| RecordingError::input(&file.path, error))?;
    let instrument = Raster::from_fn(size_px.0, size_px.1, |x, y| {
        let scaled =
            |place: u32, own: u32, full: u32| (u64::from(place) * u64::from(own) / u64::from(full)) as u32;
        let is_tissue = tissue[(scaled(x, own_px.0, size_px.0), scaled(y, own_px.1, size_px.1))] > 0;
        if is_tissue { 0 } else { 255 }
    });
    encode_png_gray(&instrument)
}

fn read_depth(
    file: &DepthFile,
    size_px: (u32, u32),
    view: &RectifiedView,
) -> Result<DepthMap, RecordingError> {
    let refused = |error| RecordingError::input(&file.path, error);
    let metres = |units: f64| (units * file.unit_m) as f32;
    Ok(match file.encoding {
        DepthEncoding::PointMap => view.depth_of(&point_map::read(&file.path, size_px, file.unit_m)?),
        DepthEncoding::Gray16 => {
            let image = read_image(&file.path, size_px)?;
            let units: Raster<u16> = decode_gray16(&image, size_px).map_err(refused)?;
            units.map(|&units| metres(f64::from(units)))
        }
        DepthEncoding::RedGreen => {
            let image = read_image(&file.path, size_px)?;
            let colours = decode_rgb(&image, size_px).map_err(refused)?;
            colours.map(|&[red, green, _]| {
                metres((f64::from(green) * 100.0 / 255.0).round() + f64::from(red) / 255.0)
            })
        }
    })
}

/// A file that is removed unless it is renamed.
pub(super) struct Unfinished {
    pub path: PathBuf,
}

impl Unfinished {
    pub fn beside(target: &Path) -> Self {
        let mut name = target.file_name().unwrap_or_default().to_owned();
        name.push(".unfinished");
        Self { path: target.with_file_name(name) }
    }

    pub fn rename_to(self, target: &Path) -> Result<(), RecordingError> {
        std::fs::rename(&self.path, target).map_err(RecordingError::io(target))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
    }
}
