// Hamming distance of the census descriptors at 16 disparities about each pixel's prior one: index k stands for
// k - 8 + the rounded prior. Paths of semi-global matching over k follow the prior's surface, slants and all, without
// penalty (Scharstein et al. 2017).
//
// left, right: descriptors from census.wgsl, padded rows. prior: disparity and more per pixel, unpadded rows. costs: as
// matching_cost.wgsl, one group. Silent and unknown pixels cost the same at all k. One invocation per pixel.

struct Matching {
    silent_cost: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> matching: Matching;
@group(0) @binding(2) var<storage, read> left: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> right: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> prior: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> costs: array<vec4<u32>>;

fn cost_at(row: u32, descriptor: u32, column: i32) -> u32 {
    if (column < 0 || column >= i32(band.width)) {
        return matching.silent_cost;
    }
    let candidate = right[row + (u32(column) >> 2u)][column & 3];
    return select(countOneBits(descriptor ^ candidate), matching.silent_cost, (candidate & SILENT) != 0u);
}

@compute @workgroup_size(64)
fn band_cost(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let index = id.y * band.width + id.x;
    let row = id.y * band.words;
    let descriptor = left[row + (id.x >> 2u)][id.x & 3u];
    let disparity = prior[index].x;
    var result = vec4<u32>(pack_bytes(vec4<u32>(matching.silent_cost)));
    if ((descriptor & SILENT) == 0u && known(disparity)) {
        let first = i32(id.x) - band_start(disparity);
        for (var word = 0u; word < 4u; word++) {
            let column = first - i32(4u * word);
            result[word] = pack_bytes(vec4<u32>(
                cost_at(row, descriptor, column),
                cost_at(row, descriptor, column - 1),
                cost_at(row, descriptor, column - 2),
                cost_at(row, descriptor, column - 3),
            ));
        }
    }
    costs[index] = result;
}
