// Halves an eye: the mean of 2 x 2 grey values, kept unrounded, and the mask of most of them.
//
// fine_grey: f32 per pixel, unpadded rows; fine_masked: packed as in prepare.wgsl. grey, luma, masked: the same of the
// half size, luma rounded to bytes; the last pixel fills the padding of luma, which is masked. Beyond an odd side the
// image's border is repeated. One invocation per word of four pixels.

struct Halving {
    fine_width: u32,
    fine_height: u32,
    fine_words: u32,
    width: u32,
    height: u32,
    words: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> halving: Halving;
@group(0) @binding(1) var<storage, read> fine_grey: array<f32>;
@group(0) @binding(2) var<storage, read> fine_masked: array<u32>;
@group(0) @binding(3) var<storage, read_write> grey: array<f32>;
@group(0) @binding(4) var<storage, read_write> luma: array<u32>;
@group(0) @binding(5) var<storage, read_write> masked: array<u32>;

fn masked_at(x: u32, y: u32) -> u32 {
    return (fine_masked[y * halving.fine_words + (x >> 2u)] >> (8u * (x & 3u))) & 1u;
}

@compute @workgroup_size(64)
fn halve(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= halving.words || id.y >= halving.height) {
        return;
    }
    let top = 2u * id.y;
    let bottom = min(top + 1u, halving.fine_height - 1u);
    var luma_word = 0u;
    var masked_word = 0u;
    for (var lane = 0u; lane < 4u; lane++) {
        let x = min(4u * id.x + lane, halving.width - 1u);
        let west = 2u * x;
        let east = min(west + 1u, halving.fine_width - 1u);
        let mean = 0.25 * (fine_grey[top * halving.fine_width + west] + fine_grey[top * halving.fine_width + east]
            + fine_grey[bottom * halving.fine_width + west] + fine_grey[bottom * halving.fine_width + east]);
        let covered = masked_at(west, top) + masked_at(east, top) + masked_at(west, bottom) + masked_at(east, bottom);
        luma_word |= u32(clamp(mean + 0.5, 0.0, 255.0)) << (8u * lane);
        masked_word |= u32(covered > 2u) << (8u * lane);
        if (4u * id.x + lane < halving.width) {
            grey[id.y * halving.width + x] = mean;
        }
    }
    let index = id.y * halving.words + id.x;
    luma[index] = luma_word;
    masked[index] = masked_word;
}
