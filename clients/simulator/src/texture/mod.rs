//! Solid texture: colour, bumps and wetness of tissue as a function of the place in the undeformed material.
//!
//! Everything is evaluated at reference coordinates in millimetres, so it sticks to the material, and takes the
//! pixel's footprint, so that what a pixel cannot resolve has faded out.

mod cells;
mod colour;
mod material;
mod noise;
mod vessel_growth;
mod vessels;

pub(crate) use colour::{Colour, encode_srgb, from_srgb, luminance};
pub(crate) use material::{Fibres, Lobules, Material, SurfacePoint, Texture};
pub(crate) use noise::{Lattice, Octave};
pub(crate) use vessel_growth::{VesselSpecies, grow};
pub(crate) use vessels::{VesselMap, VesselTone};
