//! A surfel as it is held between epochs.

use protocol::SurfelRecord;

/// An oriented disc; position and normal follow the warp, the rest changes only when the server says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfel {
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

impl From<&SurfelRecord> for Surfel {
    fn from(record: &SurfelRecord) -> Self {
        let surfel = record.unpack(0);
        Self {
            position_in_world_m: surfel.position_in_world_m,
            normal_in_world: surfel.normal_in_world,
            radius_m: surfel.radius_m,
            color: surfel.color,
            confidence: surfel.confidence,
        }
    }
}
