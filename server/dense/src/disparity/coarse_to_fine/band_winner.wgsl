// The best of the 16 disparities about the prior, refined between its neighbours' costs as in cross_check.wgsl. A
// winner at either end of the band is refused: the surface lies elsewhere.
//
// descriptors: the left eye's, padded rows. prior: unpadded rows. sums_*: two paths each, one group (with four paths
// the first two are read). disparities, spreads: padded rows, four pixels an element. One invocation per four pixels.

struct Choice {
    volumes: u32,
    // standard deviation of a match whose summed costs have curvature 1 per path
    curvature_sigma: f32,
    paths: f32,
    // the small penalty of all paths together, and the share of a neighbour's rise that may be due to it
    small_penalties: f32,
    penalty_share: f32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> choice: Choice;
@group(0) @binding(2) var<storage, read> descriptors: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> prior: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> sums_a: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> sums_b: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> sums_c: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read> sums_d: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> disparities: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> spreads: array<vec4<f32>>;

// The summed costs of disparities 4 word .. 4 word + 3.
fn costs_of(pixel: u32, word: u32) -> vec4<u32> {
    var sum = unpack_bytes(sums_a[pixel][word]) + unpack_bytes(sums_b[pixel][word]);
    if (choice.volumes == 4u) {
        sum += unpack_bytes(sums_c[pixel][word]) + unpack_bytes(sums_d[pixel][word]);
    }
    return sum;
}

// The disparity and its spread, or NO_DISPARITY.
fn choose(x: u32, y: u32) -> vec2<f32> {
    let refused = vec2<f32>(NO_DISPARITY, 0.0);
    let pixel = y * band.width + x;
    let disparity = prior[pixel].x;
    if ((descriptors[y * band.words + (x >> 2u)][x & 3u] & SILENT) != 0u || !known(disparity)) {
        return refused;
    }
    // the least of cost << 4 | index, and the costs beside it
    var best = 0xffffffffu;
    var below = 0u;
    var above = 0u;
    var before = 0u;
    var wants_above = false;
    for (var word = 0u; word < 4u; word++) {
        let costs = costs_of(pixel, word);
        for (var lane = 0u; lane < 4u; lane++) {
            let key = (costs[lane] << 4u) | (4u * word + lane);
            if (wants_above) {
                above = costs[lane];
                wants_above = false;
            }
            if (key < best) {
                best = key;
                below = before;
                wants_above = true;
            }
            before = costs[lane];
        }
    }
    let k = best & 15u;
    if (k == 0u || k == 15u) {
        return refused;
    }
    let cost = f32(best >> 4u);
    let rise = vec2<f32>(f32(below), f32(above)) - cost;
    let lifted = min(choice.small_penalties, choice.penalty_share * min(rise.x, rise.y));
    let own_rise = rise - lifted;
    let tilt = 0.25 * (own_rise.x - own_rise.y);
    let offset = tilt / max(own_rise.x + own_rise.y, 0.001) + tilt / max(max(own_rise.x, own_rise.y), 0.001);
    let spread = choice.curvature_sigma * choice.paths / max(rise.x + rise.y, 1.0);
    return vec2<f32>(f32(band_start(disparity) + i32(k)) + clamp(offset, -0.5, 0.5), spread);
}

@compute @workgroup_size(64)
fn band_winner(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    var disparity = vec4<f32>(NO_DISPARITY);
    var spread = vec4<f32>(0.0);
    for (var lane = 0u; lane < 4u; lane++) {
        if (4u * id.x + lane < band.width) {
            let result = choose(4u * id.x + lane, id.y);
            disparity[lane] = result.x;
            spread[lane] = result.y;
        }
    }
    let index = id.y * band.words + id.x;
    disparities[index] = disparity;
    spreads[index] = spread;
}
