//! Linear light and its 8-bit display encoding.

use nalgebra::Vector3;

/// Linear red, green, blue; 1 is white.
pub(crate) type Colour = Vector3<f32>;

/// Linear light of an 8-bit sRGB colour, `0xRRGGBB`.
pub(crate) fn from_srgb(rgb: u32) -> Colour {
    let linear = |shift: u32| {
        let encoded = ((rgb >> shift) & 0xff) as f32 / 255.0;
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    };
    Colour::new(linear(16), linear(8), linear(0))
}

/// sRGB encoding of linear light, 0 to 1.
pub(crate) fn encode_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Rec. 709 luminance.
pub(crate) fn luminance(colour: &Colour) -> f32 {
    0.2126 * colour.x + 0.7152 * colour.y + 0.0722 * colour.z
}
