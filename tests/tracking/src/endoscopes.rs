//! Real endoscopes.

use std::ops::RangeInclusive;
use std::path::Path;

use recording::import::ImportKind;

use crate::Error;
use crate::footage::Footage;
use crate::row::{Measured, Row};
use crate::run::{Recording, Tracked, track_all};
use crate::settings::Settings;

/// The frames of the clip before the strong deformation.
const D4D_GENTLE: RangeInclusive<usize> = 0..=75;

/// The rows of recordings without a true trajectory.
pub fn rows() -> Vec<Row> {
    let anchor = "none published";
    vec![
        Row { name: "hamlyn/6", target: "25 of 25 tracked or relocalised", anchor, measure: hamlyn },
        Row {
            name: "d4d_clip 0-75",
            target: "camera still: translation < 0.5 mm",
            anchor: "the camera does not move",
            measure: |footage, settings| d4d(footage, settings, Some(D4D_GENTLE), 0.5),
        },
        Row {
            name: "d4d_clip whole",
            target: "camera still: translation < 1.5 mm",
            anchor: "the camera does not move",
            measure: |footage, settings| d4d(footage, settings, None, 1.5),
        },
    ]
}

fn track(path: &Path, name: &str, settings: &Settings) -> Result<Vec<Tracked>, Error> {
    track_all(name, &Recording::open(path, &settings.recording)?, &settings.tracking)
}

fn hamlyn(footage: &Footage, settings: &Settings) -> Result<Measured, Error> {
    let Some(path) = footage.imported(ImportKind::Hamlyn, "hamlyn/6")? else {
        return Ok(Measured::skipped("../shared/data/hamlyn/6"));
    };
    let frames = track(&path, "hamlyn/6", settings)?;
    let found = frames.iter().filter(|frame| frame.report.world_from_camera.is_some()).count();
    Ok(Measured::new(format!("{found} of {}", frames.len()), found == frames.len()))
}

fn d4d(
    footage: &Footage,
    settings: &Settings,
    frames: Option<RangeInclusive<usize>>,
    limit_mm: f64,
) -> Result<Measured, Error> {
    let Some(path) = footage.imported(ImportKind::D4d, "d4d_clip")? else {
        return Ok(Measured::skipped("../shared/data/d4d_clip"));
    };
    let mut tracked = track(&path, "d4d_clip", settings)?;
    tracked.truncate(frames.map_or(usize::MAX, |frames| frames.end() + 1));
    let lost = tracked.iter().filter(|frame| frame.report.world_from_camera.is_none()).count();
    let poses = tracked.iter().filter_map(|frame| frame.report.world_from_camera);
    let farthest_mm = poses.map(|pose| pose.translation.vector.norm() * 1e3).fold(0.0, f64::max);
    let text = format!("{farthest_mm:.3} mm, {lost} of {} lost", tracked.len());
    Ok(Measured::new(text, farthest_mm < limit_mm && lost == 0))
}
