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

// Mean of the four grey values that pixel `x` of the row stands for.
fn mean_at(x: u32, top: u32, bottom: u32) -> f32 {
    let west = 2u * min(x, halving.width - 1u);
    let east = min(west + 1u, halving.fine_width - 1u);
    return 0.25 * (fine_grey[top + west] + fine_grey[top + east] + fine_grey[bottom + west] + fine_grey[bottom + east]);
}

// Of four bytes of 0 or 1 in two rows: the sums of the first and of the second two.
fn pair_sums(top: u32, bottom: u32) -> vec2<u32> {
    let rows = unpack_bytes(top) + unpack_bytes(bottom);
    return vec2<u32>(rows.x + rows.y, rows.z + rows.w);
}

fn store(row: u32, x: u32, mean: f32) {
    if (x < halving.width) {
        grey[row + x] = mean;
    }
}

@compute @workgroup_size(64)
fn halve(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= halving.words || id.y >= halving.height) {
        return;
    }
    let top = 2u * id.y;
    let bottom = min(top + 1u, halving.fine_height - 1u);
    let x = 4u * id.x;
    let grey_rows = vec2<u32>(top, bottom) * halving.fine_width;
    let means = vec4<f32>(mean_at(x, grey_rows.x, grey_rows.y), mean_at(x + 1u, grey_rows.x, grey_rows.y),
        mean_at(x + 2u, grey_rows.x, grey_rows.y), mean_at(x + 3u, grey_rows.x, grey_rows.y));
    let mask_rows = vec2<u32>(top, bottom) * halving.fine_words;
    let first = 2u * id.x;
    let second = min(first + 1u, halving.fine_words - 1u);
    let covered = vec4<u32>(
        pair_sums(fine_masked[mask_rows.x + first], fine_masked[mask_rows.y + first]),
        pair_sums(fine_masked[mask_rows.x + second], fine_masked[mask_rows.y + second]),
    );
    let index = id.y * halving.words + id.x;
    luma[index] = pack_bytes(vec4<u32>(clamp(means + 0.5, vec4<f32>(0.0), vec4<f32>(255.0))));
    masked[index] = pack_bytes(select(vec4<u32>(0u), vec4<u32>(1u), covered > vec4<u32>(2u)));
    let row = id.y * halving.width;
    store(row, x, means.x);
    store(row, x + 1u, means.y);
    store(row, x + 2u, means.z);
    store(row, x + 3u, means.w);
}
