//! One packed surfel, version 1: 16 bytes, little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 0-7 | position: x in bits 0-20, y in 21-41, z in 42-62, bit 63 zero; `(code - 2^20) * 0.02 mm` |
//! | 8-10 | normal, octahedral: u in bits 0-11, v in 12-23; `(code - 2047) / 2047` |
//! | 11 | radius: `10 um * 2^(code / 16)` |
//! | 12-14 | red, green, blue (sRGB) |
//! | 15 | confidence: `code / 255` |
//!
//! The position grid is fixed in the world, so all viewers hold bit-identical geometry whenever they joined.
//! Any 16 bytes decode to finite values; what cannot be packed is refused by [`SurfelRecord::pack`].

use crate::ProtocolError;

/// Bytes of a packed surfel, its id not counted.
pub const RECORD_BYTES: usize = 16;
/// Step of the position grid in each axis; positions are off by half of it at most.
pub const POSITION_STEP_M: f64 = 2e-5;

/// Surfels further from the origin in any axis have no packed form.
pub const MAX_POSITION_M: f64 = POSITION_STEP_M * (POSITION_ZERO - 1) as f64;

const POSITION_BITS: u32 = 21;
const POSITION_ZERO: i64 = 1 << (POSITION_BITS - 1);
const POSITION_MASK: u64 = (1 << POSITION_BITS) - 1;
const NORMAL_ZERO: i32 = 2047;
const RADIUS_UNIT_M: f32 = 1e-5;
const RADIUS_CODES_PER_OCTAVE: f32 = 16.0;

/// A surfel as a viewer draws it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WireSurfel {
    /// Stable while the surfel lives.
    pub id: u32,
    /// Centre.
    pub position_in_world_m: [f32; 3],
    /// Unit length, towards the side from which it was seen.
    pub normal_in_world: [f32; 3],
    /// Radius of the disc.
    pub radius_m: f32,
    /// sRGB.
    pub color: [u8; 3],
    /// 0 to 1.
    pub confidence: f32,
}

/// A packed surfel without its id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfelRecord(pub [u8; RECORD_BYTES]);

impl SurfelRecord {
    /// # Errors
    /// [`ProtocolError::Unpackable`] where a value is not finite, the position is over 20.97 m from the origin,
    /// the normal has no direction or the radius is not positive.
    pub fn pack(surfel: &WireSurfel) -> Result<Self, ProtocolError> {
        let refuse = |(field, value)| ProtocolError::Unpackable { id: surfel.id, field, value };
        let position = position_code(surfel.position_in_world_m).map_err(refuse)?;
        let normal = normal_code(surfel.normal_in_world).map_err(refuse)?;
        let mut bytes = [0; RECORD_BYTES];
        bytes[0..8].copy_from_slice(&position.to_le_bytes());
        bytes[8..11].copy_from_slice(&normal.to_le_bytes()[0..3]);
        bytes[11] = radius_code(surfel.radius_m).map_err(refuse)?;
        bytes[12..15].copy_from_slice(&surfel.color);
        bytes[15] = confidence_code(surfel.confidence).map_err(refuse)?;
        Ok(Self(bytes))
    }

    /// Centre in the world.
    pub fn position_in_world_m(&self) -> [f32; 3] {
        position_of(self.position_bits())
    }

    /// Place on a curve that keeps near what is near (Morton order of the position).
    pub(crate) fn morton_code(&self) -> u64 {
        let packed = self.position_bits();
        let axis = |axis: u32| (packed >> (axis * POSITION_BITS)) & POSITION_MASK;
        let spread = |code: u64| (0..POSITION_BITS).fold(0, |sum, bit| sum | (code >> bit & 1) << (3 * bit));
        spread(axis(0)) | spread(axis(1)) << 1 | spread(axis(2)) << 2
    }

    fn position_bits(&self) -> u64 {
        let [p0, p1, p2, p3, p4, p5, p6, p7, ..] = self.0;
        u64::from_le_bytes([p0, p1, p2, p3, p4, p5, p6, p7])
    }

    /// The surfel of this record.
    pub fn unpack(&self, id: u32) -> WireSurfel {
        let [.., n0, n1, n2, radius, red, green, blue, confidence] = self.0;
        WireSurfel {
            id,
            position_in_world_m: self.position_in_world_m(),
            normal_in_world: normal_of(u32::from_le_bytes([n0, n1, n2, 0])),
            radius_m: RADIUS_UNIT_M * (f32::from(radius) / RADIUS_CODES_PER_OCTAVE).exp2(),
            color: [red, green, blue],
            confidence: f32::from(confidence) / 255.0,
        }
    }
}

type Refused = (&'static str, f32);

fn position_code(position_m: [f32; 3]) -> Result<u64, Refused> {
    let mut packed = 0;
    for (axis, (field, value)) in ["x_m", "y_m", "z_m"].into_iter().zip(position_m).enumerate() {
        let steps = (f64::from(value) / POSITION_STEP_M).round();
        if !(steps >= -(POSITION_ZERO as f64) && steps < POSITION_ZERO as f64) {
            return Err((field, value));
        }
        packed |= ((steps as i64 + POSITION_ZERO) as u64) << (axis as u32 * POSITION_BITS);
    }
    Ok(packed)
}

fn position_of(packed: u64) -> [f32; 3] {
    [0, 1, 2].map(|axis| {
        let code = (packed >> (axis * POSITION_BITS)) & POSITION_MASK;
        ((code as i64 - POSITION_ZERO) as f64 * POSITION_STEP_M) as f32
    })
}

/// Octahedral map of a direction (Cigolle et al. 2014), 12 bits an axis; both poles and all axes are exact.
fn normal_code([x, y, z]: [f32; 3]) -> Result<u32, Refused> {
    let length = x.abs() + y.abs() + z.abs();
    if !(length.is_finite() && length > f32::MIN_POSITIVE) {
        return Err(("normal", length));
    }
    let (x, y) = (x / length, y / length);
    let (u, v) = if z >= 0.0 { (x, y) } else { fold(x, y) };
    let code =
        |a: f32| ((a * NORMAL_ZERO as f32).round() as i32 + NORMAL_ZERO).clamp(0, 2 * NORMAL_ZERO) as u32;
    Ok(code(u) | code(v) << 12)
}

fn normal_of(code: u32) -> [f32; 3] {
    let axis = |bits: u32| ((bits & 0xFFF) as i32 - NORMAL_ZERO).min(NORMAL_ZERO) as f32 / NORMAL_ZERO as f32;
    let (u, v) = (axis(code), axis(code >> 12));
    let z = 1.0 - u.abs() - v.abs();
    let (x, y) = if z >= 0.0 { (u, v) } else { fold(u, v) };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// Reflects the lower half of the octahedron over the edges of the upper one; its own inverse.
fn fold(x: f32, y: f32) -> (f32, f32) {
    ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y))
}

fn radius_code(radius_m: f32) -> Result<u8, Refused> {
    if !(radius_m.is_finite() && radius_m > 0.0) {
        return Err(("radius_m", radius_m));
    }
    let code = (RADIUS_CODES_PER_OCTAVE * (radius_m / RADIUS_UNIT_M).log2()).round();
    Ok(code.clamp(0.0, 255.0) as u8)
}

fn confidence_code(confidence: f32) -> Result<u8, Refused> {
    if !confidence.is_finite() {
        return Err(("confidence", confidence));
    }
    Ok((confidence.clamp(0.0, 1.0) * 255.0).round() as u8)
}
