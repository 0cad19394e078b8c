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

// Weighted sum of the channels in units of 2^-14 grey levels, and whether the pixel shows tissue.
struct Seen {
    weighted: u32,
    unusable: bool,
}

fn seen_at(x: u32, row: u32) -> Seen {
    let pixel = color[row + min(x, exposure.width - 1u)];
    let red = pixel & 255u;
    let green = (pixel >> 8u) & 255u;
    let blue = (pixel >> 16u) & 255u;
    let weighted = red * 4899u + green * 9617u + blue * 1868u;
    let dark = max(red, max(green, blue)) <= exposure.dark_level;
    let saturated = ((weighted + 8192u) >> 14u) >= exposure.saturated_level;
    return Seen(weighted, dark || saturated || (pixel >> 24u) == 0u);
}

fn store(row: u32, x: u32, value: f32) {
    if (x < exposure.width) {
        greys[row + x] = value;
    }
}

@compute @workgroup_size(64)
fn prepare(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= exposure.words || id.y >= exposure.height) {
        return;
    }
    let row = id.y * exposure.width;
    let x = 4u * id.x;
    let a = seen_at(x, row);
    let b = seen_at(x + 1u, row);
    let c = seen_at(x + 2u, row);
    let d = seen_at(x + 3u, row);
    let weighted = vec4<u32>(a.weighted, b.weighted, c.weighted, d.weighted);
    let unusable = vec4<bool>(a.unusable, b.unusable, c.unusable, d.unusable);
    let places = vec4<u32>(0u, 8u, 16u, 24u);
    let luma_bytes = ((weighted + 8192u) >> vec4<u32>(14u)) << places;
    let masked_bytes = vec4<u32>(unusable) << places;
    let index = id.y * exposure.words + id.x;
    luma[index] = luma_bytes.x | luma_bytes.y | luma_bytes.z | luma_bytes.w;
    masked[index] = masked_bytes.x | masked_bytes.y | masked_bytes.z | masked_bytes.w;
    let values = vec4<f32>(weighted) / 16384.0;
    store(row, x, values.x);
    store(row, x + 1u, values.y);
    store(row, x + 2u, values.z);
    store(row, x + 3u, values.w);
}
