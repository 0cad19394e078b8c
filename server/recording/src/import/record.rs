//! Recording a plan.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use geometry::{DepthMap, Raster};

use super::{DepthEncoding, DepthFile, ImportRequest, ImportSummary, Plan, PlannedFrame, files};
use crate::encoded_image::decode_gray16;
use crate::{
    EncodedImage, RecordingConfig, RecordingError, RecordingWriter, decode_rgb, encoded_image::size_px,
};

/// Records into a file beside the one asked for, and renames it once it is complete.
pub(super) fn record(
    plan: &Plan,
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
    for (done, frame) in plan.frames.iter().enumerate() {
        write_frame(&mut writer, frame, size)?;
        progress(done + 1, plan.frames.len());
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
fn origin(request: &ImportRequest) -> BTreeMap<String, String> {
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

fn write_frame(
    writer: &mut RecordingWriter,
    frame: &PlannedFrame,
    size_px: (u32, u32),
) -> Result<(), RecordingError> {
    let stamp_ns = frame.stamp_ns;
    writer.write_pair(stamp_ns, &read_image(&frame.left, size_px)?, &read_image(&frame.right, size_px)?)?;
    if let Some(mask) = &frame.mask {
        writer.write_mask(stamp_ns, &read_image(mask, size_px)?)?;
    }
    if let Some(depth) = &frame.depth {
        writer.write_truth_depth(stamp_ns, &read_depth(depth, size_px)?)?;
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

fn read_depth(file: &DepthFile, size_px: (u32, u32)) -> Result<DepthMap, RecordingError> {
    let image = read_image(&file.path, size_px)?;
    let refused = |error| RecordingError::input(&file.path, error);
    let metres = |units: f64| (units * file.unit_m) as f32;
    Ok(match file.encoding {
        DepthEncoding::Gray16 => {
            let units: Raster<u16> = decode_gray16(&image, size_px).map_err(refused)?;
            units.map(|&units| metres(f64::from(units)))
        }
        DepthEncoding::RedGreen => {
            let colours = decode_rgb(&image, size_px).map_err(refused)?;
            colours.map(|&[red, green, _]| {
                metres((f64::from(green) * 100.0 / 255.0).round() + f64::from(red) / 255.0)
            })
        }
    })
}

/// A file that is removed unless it is renamed.
struct Unfinished {
    path: PathBuf,
}

impl Unfinished {
    fn beside(target: &Path) -> Self {
        let mut name = target.file_name().unwrap_or_default().to_owned();
        name.push(".unfinished");
        Self { path: target.with_file_name(name) }
    }

    fn rename_to(self, target: &Path) -> Result<(), RecordingError> {
        std::fs::rename(&self.path, target).map_err(RecordingError::io(target))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
    }
}
