//! The simulator's surface: a mesh whose deformation has a closed form.
//!
//! `x(t) = x0 + gain(x0) r (1 - cos 2 pi f t)/2 + sum_k s((t - t_k)/d_k) psi(|x0 - c_k| / r_k) u_k`, with breathing `r`
//! at `f`, and pushes by `u_k` around `c_k`; `s` is the smootherstep, `psi` Wendland's C2 function.

use nalgebra::{Point3, Vector3};

use super::mesh_archive::MeshArchive;
use crate::EvaluationError;

/// The true surface over time, in the world of the recording.
pub(crate) struct MovingMesh {
    at_start: Vec<Point3<f64>>,
    /// Corners, as indices of vertices.
    pub faces: Vec<[u32; 3]>,
    /// In how many frames each vertex was seen.
    pub seen_frames: Vec<u32>,
    /// Seconds since the first frame, of each frame.
    times_s: Vec<f64>,
    breathing_gain: Vec<f64>,
    breathing: Vector3<f64>,
    breathing_hz: f64,
    pushes: Vec<Push>,
}

struct Push {
    centre: Point3<f64>,
    shift: Vector3<f64>,
    radius_m: f64,
    start_s: f64,
    duration_s: f64,
}

impl MovingMesh {
    /// Reads the archive `truth_mesh.npz`.
    pub(crate) fn from_npz(bytes: Vec<u8>) -> Result<Self, EvaluationError> {
        let mut archive = MeshArchive::open(bytes)?;
        let at_start: Vec<Point3<f64>> = archive.triples("v0")?.into_iter().map(Point3::from).collect();
        let vertices = at_start.len();
        let [breathing] = archive.triples("resp_vec")?[..] else {
            return Err(EvaluationError::mesh("resp_vec", "not one vector"));
        };
        let index = |values: [f64; 3]| values.map(|value| value as u32);
        let mesh = Self {
            at_start,
            faces: archive.triples("faces")?.into_iter().map(index).collect(),
            seen_frames: archive.list("seen_frames")?.into_iter().map(|count| count as u32).collect(),
            times_s: archive.list("times")?,
            breathing_gain: archive.list("resp_gain")?,
            breathing: breathing.into(),
            breathing_hz: archive.scalar("resp_hz")?,
            pushes: read_pushes(&mut archive)?,
        };
        for (array, length) in
            [("seen_frames", mesh.seen_frames.len()), ("resp_gain", mesh.breathing_gain.len())]
        {
            check_length(array, length, vertices)?;
        }
        if mesh.faces.iter().flatten().any(|&corner| corner as usize >= vertices) {
            return Err(EvaluationError::mesh(
                "faces",
                format!("an index is beyond the {vertices} vertices"),
            ));
        }
        Ok(mesh)
    }

    /// Whether a face was seen whole in at least `frames` frames.
    pub(crate) fn face_is_seen(&self, face: usize, frames: u32) -> bool {
        self.faces[face].iter().all(|&corner| self.seen_frames[corner as usize] >= frames)
    }

    /// The vertices in a frame, in the world of the recording.
    pub(crate) fn vertices(&self, frame: usize) -> Result<Vec<Point3<f64>>, EvaluationError> {
        let time_s = *self.times_s.get(frame).ok_or_else(|| {
            EvaluationError::mesh(
                "times",
                format!("{} times, but frame {frame} is asked for", self.times_s.len()),
            )
        })?;
        let breath = 0.5 * (1.0 - (std::f64::consts::TAU * self.breathing_hz * time_s).cos());
        let pushes: Vec<(&Push, f64)> = self
            .pushes
            .iter()
            .map(|push| (push, smootherstep((time_s - push.start_s) / push.duration_s)))
            .filter(|&(_, progress)| progress > 0.0)
            .collect();
        let moved = |(start, gain): (&Point3<f64>, &f64)| {
            let mut place = start + self.breathing * (gain * breath);
            for (push, progress) in &pushes {
                place += push.shift * (progress * wendland((start - push.centre).norm() / push.radius_m));
            }
            place
        };
        Ok(self.at_start.iter().zip(&self.breathing_gain).map(moved).collect())
    }
}

fn read_pushes(archive: &mut MeshArchive) -> Result<Vec<Push>, EvaluationError> {
    let centres = archive.triples("push_centre")?;
    let shifts = archive.triples("push_vec")?;
    check_length("push_vec", shifts.len(), centres.len())?;
    let mut lists = Vec::new();
    for array in ["push_radius", "push_start", "push_dur"] {
        let list = archive.list(array)?;
        check_length(array, list.len(), centres.len())?;
        lists.push(list);
    }
    let push = |(index, (centre, shift)): (usize, ([f64; 3], [f64; 3]))| Push {
        centre: centre.into(),
        shift: shift.into(),
        radius_m: lists[0][index],
        start_s: lists[1][index],
        duration_s: lists[2][index],
    };
    Ok(centres.into_iter().zip(shifts).enumerate().map(push).collect())
}

fn check_length(array: &str, length: usize, expected: usize) -> Result<(), EvaluationError> {
    if length == expected {
        return Ok(());
    }
    Err(EvaluationError::mesh(array, format!("{length} entries, expected {expected}")))
}

/// Compactly supported, twice differentiable: `(1 - r)^4 (4 r + 1)` for `r < 1`.
fn wendland(r: f64) -> f64 {
    let r = r.clamp(0.0, 1.0);
    (1.0 - r).powi(4) * (4.0 * r + 1.0)
}

fn smootherstep(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (x * (6.0 * x - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn garbage_in_place_of_the_archive_is_refused() {
        let refusal = MovingMesh::from_npz(b"not a zip file".to_vec()).err().expect("garbage").to_string();
        assert!(refusal.starts_with("truth_mesh.npz: archive:"), "{refusal}");
    }

    #[test]
    fn fall_offs_start_and_end_flat() {
        assert_eq!((wendland(0.0), wendland(1.0), wendland(7.0)), (1.0, 0.0, 0.0));
        assert_eq!((smootherstep(-1.0), smootherstep(0.5), smootherstep(2.0)), (0.0, 0.5, 1.0));
    }
}
