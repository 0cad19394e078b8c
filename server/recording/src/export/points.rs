//! Point tracks as text: `frame,id,x,y,z` a line, metres in world.

use std::path::Path;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::RecordingError;

/// Where the model says a material point is, in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedPoint {
    /// Index of the frame.
    pub frame: u32,
    /// The point's name in `/truth/points`.
    pub id: u32,
    /// Its place, metres.
    pub point_in_world: Point3<f64>,
}

#[derive(Serialize, Deserialize)]
struct Row {
    frame: u32,
    id: u32,
    x: f64,
    y: f64,
    z: f64,
}

/// Writes point tracks in the order given.
///
/// # Errors
/// [`RecordingError::Io`] or [`RecordingError::Input`].
pub fn write_points<'a>(
    path: &Path,
    points: impl IntoIterator<Item = &'a TrackedPoint>,
) -> Result<(), RecordingError> {
    let refused = |error: csv::Error| RecordingError::input(path, error);
    let mut writer = csv::Writer::from_path(path).map_err(refused)?;
    for &TrackedPoint { frame, id, point_in_world: p } in points {
        writer.serialize(Row { frame, id, x: p.x, y: p.y, z: p.z }).map_err(refused)?;
    }
    writer.flush().map_err(RecordingError::io(path))
}

/// Reads point tracks.
///
/// # Errors
/// [`RecordingError::Input`] naming the line.
pub fn read_points(path: &Path) -> Result<Vec<TrackedPoint>, RecordingError> {
    let refused = |error: csv::Error| RecordingError::input(path, error);
    let mut reader = csv::Reader::from_path(path).map_err(refused)?;
    let rows = reader.deserialize().map(|row| {
        let Row { frame, id, x, y, z } = row.map_err(refused)?;
        Ok(TrackedPoint { frame, id, point_in_world: Point3::new(x, y, z) })
    });
    rows.collect()
}
