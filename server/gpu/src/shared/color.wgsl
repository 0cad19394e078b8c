// 8-bit colour in one u32: red in the lowest byte, then green, blue, and alpha (0: the colour says nothing).

fn unpack_rgb(packed: u32) -> vec3<f32> {
    return vec3<f32>(f32(packed & 0xffu), f32((packed >> 8u) & 0xffu), f32((packed >> 16u) & 0xffu));
}

fn pack_rgb(rgb: vec3<f32>) -> u32 {
    let byte = vec3<u32>(clamp(round(rgb), vec3<f32>(0.0), vec3<f32>(255.0)));
    return byte.x | (byte.y << 8u) | (byte.z << 16u) | 0xff000000u;
}

fn has_color(packed: u32) -> bool {
    return (packed >> 24u) != 0u;
}
