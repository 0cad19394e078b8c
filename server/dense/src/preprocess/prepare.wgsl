// Grey values and masks of one eye, packed four pixels a word.
//
// color: red, green, blue from the lowest byte up and 255 in the highest byte, 0 there where an instrument covers the
// tissue; unpadded rows. luma: Rec. 601 in 8-bit fixed point, as `Rgb::to_gray`; the last pixel fills the padding.
// greys: the same before it is rounded, as f32 in unpadded rows.
// masked: per pixel 0, or 1 where dark (also the black frame), saturated, or covered. One invocation per word.

struct Exposure {
    width: u32,
    height: u32,
    // words of four pixels per row
    words: u32,
    // grey level from which a pixel is a highlight
    saturated_level: u32,
    // level up to which all three channels lie in a dark pixel
    dark_level: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> exposure: Exposure;
@group(0) @binding(1) var<storage, read> color: array<u32>;
@group(0) @binding(2) var<storage, read_write> luma: array<u32>;
@group(0) @binding(3) var<storage, read_write> masked: array<u32>;
@group(0) @binding(4) var<storage, read_write> greys: array<f32>;

@compute @workgroup_size(64)
fn prepare(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= exposure.words || id.y >= exposure.height) {
        return;
    }
    var luma_word = 0u;
    var masked_word = 0u;
    for (var lane = 0u; lane < 4u; lane++) {
        let x = min(4u * id.x + lane, exposure.width - 1u);
        let pixel = color[id.y * exposure.width + x];
        let red = pixel & 255u;
        let green = (pixel >> 8u) & 255u;
        let blue = (pixel >> 16u) & 255u;
        let weighted = red * 4899u + green * 9617u + blue * 1868u;
        let grey = (weighted + 8192u) >> 14u;
        let dark = max(red, max(green, blue)) <= exposure.dark_level;
        let unusable = dark || grey >= exposure.saturated_level || (pixel >> 24u) == 0u;
        greys[id.y * exposure.width + x] = f32(weighted) / 16384.0;
        luma_word |= grey << (8u * lane);
        masked_word |= u32(unusable) << (8u * lane);
    }
    let index = id.y * exposure.words + id.x;
    luma[index] = luma_word;
    masked[index] = masked_word;
}
