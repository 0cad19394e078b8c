//! Surfel models as PLY: one `vertex` a surfel.

use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType,
    ScalarType,
};
use ply_rs_bw::writer::Writer;

use crate::RecordingError;

const VERTEX: &str = "vertex";

/// A surfel as it is exported; metres in world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlySurfel {
    /// Place.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Red, green, blue.
    pub color: [u8; 3],
    /// Radius of the disc.
    pub radius_m: f32,
    /// Weight of the running average.
    pub confidence: f32,
}

impl PlySurfel {
    /// Bytes of a surfel in a PLY file and in the model messages of recordings.
    pub(crate) const BYTES: usize = 35;

    /// The surfel as both hold it.
    pub(crate) fn to_le_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let [x, y, z] = self.position;
        let [nx, ny, nz] = self.normal;
        for (slot, value) in bytes[..24].as_chunks_mut::<4>().0.iter_mut().zip([x, y, z, nx, ny, nz]) {
            *slot = value.to_le_bytes();
        }
        bytes[24..27].copy_from_slice(&self.color);
        bytes[27..31].copy_from_slice(&self.radius_m.to_le_bytes());
        bytes[31..].copy_from_slice(&self.confidence.to_le_bytes());
        bytes
    }

    fn float_mut(&mut self, name: &str) -> Option<&mut f32> {
        Some(match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "radius" => &mut self.radius_m,
            "confidence" => &mut self.confidence,
            _ => return None,
        })
    }
}

impl PropertyAccess for PlySurfel {
    fn new() -> Self {
        Self::default()
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        match self.float_mut(name) {
            Some(slot) => {
                *slot = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set_float(name, value as f32)
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        let channel = match name {
            "red" => 0,
            "green" => 1,
            "blue" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.color[channel] = value;
        PropertyAccessResult::Set
    }
}

/// Writes surfels as binary little-endian PLY: x y z nx ny nz red green blue radius confidence.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_ply(path: &Path, surfels: &[PlySurfel]) -> Result<(), RecordingError> {
    let write = || encode_ply(BufWriter::new(File::create(path)?), surfels);
    write().map_err(RecordingError::io(path))
}

/// The same to anything that takes bytes.
///
/// # Errors
/// Those of `to`.
pub fn encode_ply(mut to: impl Write, surfels: &[PlySurfel]) -> std::io::Result<()> {
    Writer::<PlySurfel>::new().write_header(&mut to, &header(surfels.len()))?;
    for surfel in surfels {
        to.write_all(&surfel.to_le_bytes())?;
    }
    to.flush()
}

fn header(count: usize) -> Header {
    let mut vertex = ElementDef::new(VERTEX.to_owned());
    vertex.count = count;
    let float = ["x", "y", "z", "nx", "ny", "nz"].map(|name| (name, ScalarType::Float));
    let color = ["red", "green", "blue"].map(|name| (name, ScalarType::UChar));
    let weight = ["radius", "confidence"].map(|name| (name, ScalarType::Float));
    for (name, kind) in float.into_iter().chain(color).chain(weight) {
        vertex.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(kind)));
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.add(vertex);
    header
}

/// Reads the vertices of a PLY of any encoding; properties that are not there stay 0, others are skipped.
///
/// # Errors
/// [`RecordingError::Io`], or [`RecordingError::Input`] where it is no PLY, cut short, or has no vertex element.
pub fn read_ply(path: &Path) -> Result<Vec<PlySurfel>, RecordingError> {
    let refused = |problem: &dyn std::fmt::Display| RecordingError::input(path, problem);
    let file = File::open(path).map_err(RecordingError::io(path))?;
    let mut reader = Reader::new(BufReader::new(file));
    let parser = Parser::<PlySurfel>::new();
    let header = parser.read_header(&mut reader).map_err(|error| refused(&error))?;
    for (name, element) in &header.elements {
        let values = parser
            .read_payload_for_element(&mut reader, element, &header)
            .map_err(|error| refused(&error))?;
        if name == VERTEX {
            return Ok(values);
        }
    }
    Err(refused(&"no vertex element"))
}
