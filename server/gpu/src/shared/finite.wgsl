// Guards that reject NaN and infinity by their bits: a shader compiler may assume that they do not occur.

fn is_finite(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7f800000u) != 0x7f800000u;
}

fn all_finite(value: vec3<f32>) -> bool {
    return is_finite(value.x) && is_finite(value.y) && is_finite(value.z);
}
