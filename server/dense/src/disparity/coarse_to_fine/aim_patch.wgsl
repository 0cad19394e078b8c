// Inverse search, one cell's share (the linearised patch match of Kroeger et al. 2016, after Baker and Matthews):
// with rho the difference of the eyes at the present disparity d and J the image gradient there, summed over the
// cell's pixels, the cell asks for
//   z = d - sum(rho J) / (sum(J^2) + lambda)   with weight   w = sum(J^2) + lambda,
// lambda holding it at d where there is no texture. fit_patch.wgsl sums these over planar patches.
//
// planes: disparity and more per cell, unpadded rows. left, right: high_pass.wgsl, unpadded rows, of the images in which
// a cell has `cell` x `cell` pixels: those of the next finer level, or (one pixel) of the planes' own. targets: d, z - d
// and w in pixels of the planes' level; w = 0 where d is unknown. One invocation per cell.

struct Aim {
    // side of a cell, pixels of the images
    cell: u32,
    // columns and rows of the images
    width: u32,
    height: u32,
    // lambda, squared grey levels per pixel
    prior_weight: f32,
    // grey levels: larger differences are not texture
    difference_max: f32,
    // px of the images: largest step
    step_max: f32,
    padding_a: f32,
    padding_b: f32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> aim: Aim;
@group(0) @binding(2) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> left: array<u32>;
@group(0) @binding(4) var<storage, read> right: array<u32>;
@group(0) @binding(5) var<storage, read_write> targets: array<PatchTarget>;

// J^2 and rho J of one pixel, whose partner is `partner`; zeros where that or a neighbour is not seen.
fn share_of(x: u32, y: u32, partner: f32) -> vec2<f32> {
    if (!(partner >= 1.0 && partner < f32(aim.width) - 2.0) || x == 0u || x + 1u >= aim.width || y >= aim.height) {
        return vec2<f32>(0.0);
    }
    let row = y * aim.width;
    let start = u32(partner);
    let part = partner - f32(start);
    // left: x - 1, x; x, x + 1. right: start - 1, start; start + 1, start + 2
    let left_west = unpack2x16snorm(left[row + x - 1u]);
    let left_east = unpack2x16snorm(left[row + x]);
    let right_west = unpack2x16snorm(right[row + start - 1u]);
    let right_east = unpack2x16snorm(right[row + start + 1u]);
    let low = min(min(left_west, left_east), min(right_west, right_east));
    if (min(low.x, low.y) <= COVERED) {
        return vec2<f32>(0.0);
    }
    let west = mix(right_west.x, right_west.y, part);
    let here = mix(right_west.y, right_east.x, part);
    let east = mix(right_east.x, right_east.y, part);
    let slope = 0.25 * LEVELS * (east - west + left_east.y - left_west.x);
    let difference = clamp(LEVELS * (left_east.x - here), -aim.difference_max, aim.difference_max);
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
        targets[index] = target_of(NO_DISPARITY, 0.0, 0.0);
        return;
    }
    let scale = f32(aim.cell);
    let corner = aim.cell * id.xy;
    // a quarter of a cell off its centre lie the pixels of a cell of two
    let first = f32(corner.x) - scale * plane.x;
    var share = vec2<f32>(0.0);
    if (aim.cell == 1u) {
        share = share_of(corner.x, corner.y, first);
    } else {
        // written out: a loop costs more than its body
        let x = corner + 1u;
        let across = 0.5 * plane.y;
        let down = 0.5 * plane.z;
        share = share_of(corner.x, corner.y, first + across + down)
            + share_of(x.x, corner.y, first + 1.0 - across + down)
            + share_of(corner.x, x.y, first + across - down)
            + share_of(x.x, x.y, first + 1.0 - across - down);
    }
    let weight = share.x + aim.prior_weight;
    let step = clamp(-share.y / weight, -aim.step_max, aim.step_max) / scale;
    targets[index] = target_of(plane.x, step, weight);
}
