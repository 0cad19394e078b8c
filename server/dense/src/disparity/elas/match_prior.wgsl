// Maximum a posteriori disparity of each pixel of both views (section 3.3, Eq. 10): the least energy among the
// disparities about the plane of the pixel's triangle and the candidates of its grid cell. Energies are
//   E(d) = beta |f - f'(d)|_1 - log(gamma + exp(-(d - mu)^2 / (2 sigma^2))),   the second term only about the plane,
// divided by beta, the difference and so the energy counted in quarters. The left view is refined between the costs of its neighbours as in
// cross_check.wgsl.
//
// energies: match_candidates.wgsl. planes: per triangle d = x a + y b + c and 1 where it is not too steep for a prior.
// found: disparity (NO_DISPARITY where none) and its standard deviation. One invocation per pixel and view.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> search: Search;
@group(0) @binding(2) var<storage, read> descriptors: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> energies: array<u32>;
@group(0) @binding(4) var<storage, read> triangle_of: array<u32>;
@group(0) @binding(5) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> found: array<vec2<f32>>;

fn cost_at(view: u32, x: u32, y: u32, own: vec4<u32>, index: u32) -> u32 {
    let partner = i32(x) + partner_step(view) * (band.min_disparity + i32(index));
    if (partner < 0 || partner >= i32(band.width)) {
        return NO_MATCH;
    }
    return difference(own, descriptors[pixel_index(1u - view, u32(partner), y)]);
}

// The least of `least` and the energies about the plane.
fn with_prior(least: u32, view: u32, x: u32, y: u32, own: vec4<u32>, plane: vec4<f32>) -> u32 {
    let last = i32(16u * band.groups) - 1;
    let planar = plane.x * f32(x) + plane.y * f32(y) + plane.z;
    // far outside the range there is nothing to search, and no integer to overflow
    let middle = i32(round(clamp(planar, -4096.0, 4096.0))) - band.min_disparity;
    var result = least;
    for (var index = max(middle - search.radius, 0); index <= min(middle + search.radius, last); index++) {
        let cost = cost_at(view, x, y, own, u32(index));
        if (cost != NO_MATCH) {
            let distance = u32(abs(index - middle));
            let bonus = select(0u, search.bonus[distance >> 2u][distance & 3u], plane.w > 0.0);
            let energy = 4u * cost + search.bonus[0].x - bonus;
            result = min(result, (energy << 10u) | u32(index));
        }
    }
    return result;
}

// Offset of the minimum between the costs of the neighbours, and the standard deviation.
fn refine(below: u32, cost: u32, above: u32) -> vec2<f32> {
    let rise = vec2<f32>(f32(below), f32(above)) - f32(cost);
    let tilt = 0.25 * (rise.x - rise.y);
    let offset = tilt / max(rise.x + rise.y, 1.0) + tilt / max(max(rise.x, rise.y), 1.0);
    return vec2<f32>(clamp(offset, -0.5, 0.5), search.rise_sigma / max(rise.x + rise.y, 1.0));
}

fn disparity_at(view: u32, x: u32, y: u32) -> vec2<f32> {
    let none = vec2<f32>(NO_DISPARITY, 0.0);
    let at = pixel_index(view, x, y);
    let own = descriptors[at];
    let triangle = triangle_of[at];
    if (triangle == 0u || is_silent(own) || texture(own) < search.match_texture) {
        return none;
    }
    // a plane between far points is no evidence
    if (search.prior_alone == 0u && energies[at] == NO_MATCH) {
        return none;
    }
    let least = with_prior(energies[at], view, x, y, own, planes[triangle - 1u]);
    let index = least & 1023u;
    if (least == NO_MATCH || index == 0u || index + 1u >= 16u * band.groups) {
        return none;
    }
    let disparity = f32(band.min_disparity + i32(index));
    if (view == 1u) {
        return vec2<f32>(disparity, 0.0);
    }
    let below = cost_at(view, x, y, own, index - 1u);
    let above = cost_at(view, x, y, own, index + 1u);
    if (below == NO_MATCH || above == NO_MATCH) {
        return none;
    }
    let refined = refine(below, cost_at(view, x, y, own, index), above);
    return vec2<f32>(disparity + refined.x, refined.y);
}

@compute @workgroup_size(64)
fn match_prior(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    found[pixel_index(id.z, id.x, id.y)] = disparity_at(id.z, id.x, id.y);
}
