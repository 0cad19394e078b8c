//! The true surface of a run and its motion, as arrays for the recording's attachment `truth_mesh.npz`.

use std::io::{self, Cursor, Seek, Write};

use nalgebra::{Point3, Vector3};
use npyz::npz::NpzWriter;
use npyz::zip::write::FileOptions;
use npyz::{AutoSerialize, WriterBuilder};

use crate::{Push, SimulatorError};

/// The deforming mesh in closed form; see [`Push`] for the pushes.
///
/// `x(t) = rest + breathing_gain * breathing_m * (1 - cos(2 pi breathing_hz t)) / 2 + pushes`, t since the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthMesh {
    /// Vertices at the first frame in the world, metres, of single precision.
    pub rest_m: Vec<Point3<f64>>,
    /// Vertex indices, outward side counter-clockwise.
    pub faces: Vec<[u32; 3]>,
    /// Frames in which the left eye sees each vertex.
    pub seen_frames: Vec<u16>,
    /// Vertices before those of the wall or bed behind the organs.
    pub organ_vertices: usize,
    /// Seconds of each frame since the first.
    pub times_s: Vec<f64>,
    /// Stamp of each frame.
    pub stamps_ns: Vec<u64>,
    /// Share of the breathing (or beat) by vertex.
    pub breathing_gain: Vec<f32>,
    /// Displacement by breathing at its peak.
    pub breathing_m: Vector3<f64>,
    /// Breaths a second.
    pub breathing_hz: f64,
    /// All pushes in order of their start.
    pub pushes: Vec<Push>,
}

impl TruthMesh {
    /// The `npz` archive that evaluation reads, in metres and seconds: `v0`, `faces`, `seen_frames`, `n_organ`,
    /// `times`, `stamps`, `resp_gain`, `resp_vec`, `resp_hz`, `push_centre`, `push_vec`, `push_radius`, `push_start`,
    /// `push_dur`.
    ///
    /// # Errors
    /// [`SimulatorError::TruthMesh`] if the archive cannot be written to memory.
    pub fn to_npz(&self) -> Result<Vec<u8>, SimulatorError> {
        let mut bytes = Cursor::new(Vec::new());
        self.write(&mut NpzWriter::new(&mut bytes))?;
        Ok(bytes.into_inner())
    }

    fn write<W: Write + Seek>(&self, npz: &mut NpzWriter<W>) -> io::Result<()> {
        let vertices = self.rest_m.len() as u64;
        let pushes = self.pushes.len() as u64;
        let per_push = |value: fn(&Push) -> f64| self.pushes.iter().map(value).collect::<Vec<_>>();
        let flat = |vector: fn(&Push) -> Vector3<f64>| {
            self.pushes.iter().flat_map(|push| <[f64; 3]>::from(vector(push))).collect::<Vec<_>>()
        };
        let rest = self.rest_m.iter().flat_map(|p| p.iter().map(|&x| x as f32).collect::<Vec<_>>());
        put(npz, "v0", &[vertices, 3], rest)?;
        let faces = self.faces.iter().flatten().map(|&i| i as i32);
        put(npz, "faces", &[self.faces.len() as u64, 3], faces)?;
        put(npz, "seen_frames", &[vertices], self.seen_frames.iter().copied())?;
        put(npz, "n_organ", &[], [self.organ_vertices as i64])?;
        put(npz, "times", &[self.times_s.len() as u64], self.times_s.iter().copied())?;
        put(npz, "stamps", &[self.stamps_ns.len() as u64], self.stamps_ns.iter().map(|&ns| ns as i64))?;
        put(npz, "resp_gain", &[vertices], self.breathing_gain.iter().copied())?;
        put(npz, "resp_vec", &[3], self.breathing_m.iter().copied())?;
        put(npz, "resp_hz", &[], [self.breathing_hz])?;
        put(npz, "push_centre", &[pushes, 3], flat(|push| push.centre_m.coords))?;
        put(npz, "push_vec", &[pushes, 3], flat(|push| push.displacement_m))?;
        put(npz, "push_radius", &[pushes], per_push(|push| push.radius_m))?;
        put(npz, "push_start", &[pushes], per_push(|push| push.start_s))?;
        put(npz, "push_dur", &[pushes], per_push(|push| push.duration_s))
    }
}

/// Writes one array.
fn put<W: Write + Seek, T: AutoSerialize>(
    npz: &mut NpzWriter<W>,
    name: &str,
    shape: &[u64],
    values: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    let options = FileOptions::default().compression_method(npyz::zip::CompressionMethod::Deflated);
    let mut array = npz.array(name, options)?.default_dtype().shape(shape).begin_nd()?;
    array.extend(values)?;
    array.finish()
}
