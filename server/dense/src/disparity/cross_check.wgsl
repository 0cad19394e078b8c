// Accepts a winner that is unique, inside the range, and found again from the right view; refines it between its
// neighbours' costs, by the mean of a parabola and an equiangular fit: each alone prefers whole or half pixels, in
// opposite senses. The small penalty raises both neighbours alike, which pulls towards whole pixels as well: a share
// of it is taken off first.
//
// left_winners, right_winners, sums_*: winner.wgsl and aggregate.wgsl, rows of the band. disparities: four pixels an
// element, padded rows of the whole image, NO_DISPARITY where refused. spreads: what the match itself says of its standard
// deviation, from the curvature of the costs and the disagreement of the views. One invocation per four pixels.

struct Acceptance {
    // per cent by which the second best must be worse
    uniqueness_percent: u32,
    // largest disagreement of the two views
    difference_max: i32,
    // standard deviation of a match whose summed costs have curvature 1 per path
    curvature_sigma: f32,
    paths: f32,
    volumes: u32,
    // the small penalty of all paths together, and the share of a neighbour's rise that may be due to it
    small_penalties: f32,
    penalty_share: f32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> acceptance: Acceptance;
@group(0) @binding(2) var<storage, read> left: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> left_winners: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> right_winners: array<u32>;
@group(0) @binding(5) var<storage, read> sums_a: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> sums_b: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read> sums_c: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read> sums_d: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read_write> disparities: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read_write> spreads: array<vec4<f32>>;

fn summed_cost(pixel: u32, d: u32) -> f32 {
    let index = pixel * band.groups + (d >> 4u);
    let word = (d >> 2u) & 3u;
    let shift = 8u * (d & 3u);
    var sum = ((sums_a[index][word] >> shift) & 255u) + ((sums_b[index][word] >> shift) & 255u);
    if (acceptance.volumes == 4u) {
        sum += ((sums_c[index][word] >> shift) & 255u) + ((sums_d[index][word] >> shift) & 255u);
    }
    return f32(sum);
}

// The accepted disparity and its spread, or NO_DISPARITY.
fn accept(x: u32, row: u32) -> vec2<f32> {
    let refused = vec2<f32>(NO_DISPARITY, 0.0);
    let pixel = row * band.width + x;
    let found = left_winners[pixel];
    let best = found.x >> 16u;
    let d = found.x & 0xffffu;
    if (d == 0u || d + 1u >= 16u * band.groups) {
        return refused;
    }
    if (found.y * (100u - acceptance.uniqueness_percent) < best * 100u) {
        return refused;
    }
    let partner = i32(x) - band.min_disparity - i32(d);
    if (partner < 0 || partner >= i32(band.width)) {
        return refused;
    }
    let from_right = i32(right_winners[row * band.width + u32(partner)]);
    if (abs(from_right - i32(d)) > acceptance.difference_max) {
        return refused;
    }
    let below = summed_cost(pixel, d - 1u);
    let above = summed_cost(pixel, d + 1u);
    let rise = vec2<f32>(below, above) - f32(best);
    let lifted = min(acceptance.small_penalties, acceptance.penalty_share * min(rise.x, rise.y));
    let own_rise = rise - lifted;
    let tilt = 0.25 * (own_rise.x - own_rise.y);
    let offset = tilt / max(own_rise.x + own_rise.y, 0.001) + tilt / max(max(own_rise.x, own_rise.y), 0.001);
    let disagreement = f32(from_right - i32(d)) - offset;
    let spread = acceptance.curvature_sigma * acceptance.paths / max(rise.x + rise.y, 1.0)
        + 0.1 * max(abs(disagreement) - 0.5, 0.0);
    return vec2<f32>(f32(i32(d) + band.min_disparity) + clamp(offset, -0.5, 0.5), spread);
}

@compute @workgroup_size(64)
fn cross_check(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.keep_rows) {
        return;
    }
    let y = band.keep_first + id.y;
    let index = y * band.words + id.x;
    let descriptors = left[index];
    var disparity = vec4<f32>(NO_DISPARITY);
    var spread = vec4<f32>(0.0);
    for (var lane = 0u; lane < 4u; lane++) {
        // the padding is silent as well
        if ((descriptors[lane] & SILENT) == 0u) {
            let result = accept(4u * id.x + lane, y - band.first_row);
            disparity[lane] = result.x;
            spread[lane] = result.y;
        }
    }
    disparities[index] = disparity;
    spreads[index] = spread;
}
