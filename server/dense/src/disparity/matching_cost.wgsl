// Hamming distance of the census descriptors for every pixel and disparity of the band.
//
// left, right: descriptors from census.wgsl; costs: one byte per pixel and disparity, 16 disparities a vec4 of four
// words, all groups of a pixel side by side, pixels in unpadded rows of the band. A pair of which one is SILENT
// (masked, outside) costs the same at all disparities, so its neighbours decide. One invocation per four pixels.

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
@group(0) @binding(4) var<storage, read_write> costs: array<vec4<u32>>;

// The right image's descriptors from `column` on, a multiple of four.
fn right_at(row_start: u32, column: i32) -> vec4<u32> {
    let word = column >> 2u;
    if (word < 0 || word >= i32(band.words)) {
        return vec4<u32>(SILENT);
    }
    return right[row_start + u32(word)];
}

fn packed_costs(descriptor: u32, candidates: vec4<u32>) -> u32 {
    let reference = vec4<u32>(descriptor);
    let silent = ((reference | candidates) & vec4<u32>(SILENT)) != vec4<u32>(0u);
    return pack_bytes(select(countOneBits(reference ^ candidates), vec4<u32>(matching.silent_cost), silent));
}

// One word of costs for each of four neighbouring pixels: four disparities, whose partners for pixel `p` end with
// column `p` of `near` and reach into `far`, the four columns to its left.
fn word_of_costs(reference: vec4<u32>, near: vec4<u32>, far: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        packed_costs(reference.x, vec4<u32>(near.x, far.wzy)),
        packed_costs(reference.y, vec4<u32>(near.yx, far.wz)),
        packed_costs(reference.z, vec4<u32>(near.zyx, far.w)),
        packed_costs(reference.w, near.wzyx),
    );
}

@compute @workgroup_size(32)
fn matching_cost(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.rows) {
        return;
    }
    let row_start = (band.first_row + id.y) * band.words;
    let reference = left[row_start + id.x];
    let x = 4u * id.x;
    let pixel = id.y * band.width + x;
    var column = i32(x) - band.min_disparity;
    var near = right_at(row_start, column);
    for (var group = 0u; group < band.groups; group++) {
        let second = right_at(row_start, column - 4);
        let third = right_at(row_start, column - 8);
        let fourth = right_at(row_start, column - 12);
        let last = right_at(row_start, column - 16);
        let a = word_of_costs(reference, near, second);
        let b = word_of_costs(reference, second, third);
        let c = word_of_costs(reference, third, fourth);
        let d = word_of_costs(reference, fourth, last);
        let target_index = pixel * band.groups + group;
        costs[target_index] = vec4<u32>(a.x, b.x, c.x, d.x);
        if (x + 1u < band.width) {
            costs[target_index + band.groups] = vec4<u32>(a.y, b.y, c.y, d.y);
        }
        if (x + 2u < band.width) {
            costs[target_index + 2u * band.groups] = vec4<u32>(a.z, b.z, c.z, d.z);
        }
        if (x + 3u < band.width) {
            costs[target_index + 3u * band.groups] = vec4<u32>(a.w, b.w, c.w, d.w);
        }
        near = last;
        column -= 16;
    }
}
