//! Result files, and their readers: PLY models, TUM trajectories, PFM depth maps, CSV point tracks.

mod pfm;
mod ply;
mod points;
mod tum;

pub use pfm::{read_pfm, write_pfm};
pub use ply::{PlySurfel, encode_ply, read_ply, write_ply};
pub use points::{TrackedPoint, read_points, write_points};
pub use tum::{read_tum, tum_text, write_tum};
