// Inverse search, one cell's share (the linearised patch match of Kroeger et al. 2016, after Baker and Matthews):
// with rho the difference of the eyes at the present disparity d and J the image gradient there, summed over the
// cell's pixels, the cell asks for
//   z = d - sum(rho J) / (sum(J^2) + lambda)   with weight   w = sum(J^2) + lambda,
// lambda holding it at d where there is no texture. fit_patch.wgsl sums these over planar patches.
//
// planes: disparity and more per cell, unpadded rows. left, right: high_pass.wgsl, unpadded rows, and masks, packed in
// padded rows, of the images in which a cell has `cell` x `cell` pixels: those of the next finer level, or (one pixel)
// of the planes' own. targets: d, z, w, 0 in pixels of the planes' level; w = 0 where d is unknown.
// One invocation per cell.

struct Aim {
    // side of a cell, pixels of the images
    cell: u32,
    // columns, rows and words per row of the images
    width: u32,
    height: u32,
    words: u32,
    // lambda, squared grey levels per pixel
    prior_weight: f32,
    // grey levels: larger differences are not texture
    difference_max: f32,
    // px of the images: largest step
    step_max: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> aim: Aim;
@group(0) @binding(2) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> left: array<f32>;
@group(0) @binding(4) var<storage, read> right: array<f32>;
@group(0) @binding(5) var<storage, read> left_masked: array<u32>;
@group(0) @binding(6) var<storage, read> right_masked: array<u32>;
@group(0) @binding(7) var<storage, read_write> targets: array<vec4<f32>>;

// J^2 and rho J of one pixel, whose partner is `partner`; zeros where that is not seen.
fn share_of(x: u32, y: u32, partner: f32) -> vec2<f32> {
    if (!(partner >= 1.0 && partner < f32(aim.width) - 2.0) || x == 0u || x + 1u >= aim.width || y >= aim.height) {
        return vec2<f32>(0.0);
    }
    let words = y * aim.words;
    let nearest = u32(partner + 0.5);
    let covered = (left_masked[words + (x >> 2u)] >> (8u * (x & 3u)))
        | (right_masked[words + (nearest >> 2u)] >> (8u * (nearest & 3u)));
    if ((covered & 255u) != 0u) {
        return vec2<f32>(0.0);
    }
    let row = y * aim.width;
    let start = u32(partner);
    let part = partner - f32(start);
    let at = row + start;
    let west = mix(right[at - 1u], right[at], part);
    let here = mix(right[at], right[at + 1u], part);
    let east = mix(right[at + 1u], right[at + 2u], part);
    let own = row + x;
    let slope = 0.25 * (east - west + left[own + 1u] - left[own - 1u]);
    let difference = clamp(left[own] - here, -aim.difference_max, aim.difference_max);
    return vec2<f32>(slope * slope, difference * slope);
}

@compute @workgroup_size(64)
fn aim_patch(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let index = id.y * band.width + id.x;
    let plane = planes[index];
    if (!known(plane.x)) {
        targets[index] = vec4<f32>(NO_DISPARITY, NO_DISPARITY, 0.0, 0.0);
        return;
    }
    let scale = f32(aim.cell);
    var share = vec2<f32>(0.0);
    for (var v = 0u; v < aim.cell; v++) {
        for (var u = 0u; u < aim.cell; u++) {
            let offset = (vec2<f32>(f32(u), f32(v)) - 0.5 * (scale - 1.0)) / scale;
            let x = aim.cell * id.x + u;
            let d = scale * (plane.x + dot(plane.yz, offset));
            share += share_of(x, aim.cell * id.y + v, f32(x) - d);
        }
    }
    let weight = share.x + aim.prior_weight;
    let step = clamp(-share.y / weight, -aim.step_max, aim.step_max) / scale;
    targets[index] = vec4<f32>(plane.x, plane.x + step, weight, 0.0);
}
