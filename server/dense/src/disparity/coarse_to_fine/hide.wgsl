// Refuses what the right eye cannot have seen: pixels that are masked, whose partner lies outside the right image, or
// before whose partner another pixel's surface stands. Disparities outside the searched range are refused as well.
//
// planes: disparity and more per pixel, unpadded rows, changed in place. masked: packed, padded rows. nearest: one f32
// per pixel, scratch. One invocation per row.

struct Hiding {
    // px: by how much a surface must be nearer to hide another
    tolerance: f32,
    // px: the range searched
    disparity_min: f32,
    disparity_max: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> hiding: Hiding;
@group(0) @binding(2) var<storage, read> masked: array<u32>;
@group(0) @binding(3) var<storage, read_write> nearest: array<f32>;
@group(0) @binding(4) var<storage, read_write> planes: array<vec4<f32>>;

// Column of the right image, -1 outside.
fn partner_of(x: u32, d: f32) -> i32 {
    let column = floor(f32(x) - d + 0.5);
    return select(-1, i32(column), column >= 0.0 && column < f32(band.width));
}

@compute @workgroup_size(32)
fn hide(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.height) {
        return;
    }
    let row = id.x * band.width;
    for (var x = 0u; x < band.width; x++) {
        nearest[row + x] = NO_DISPARITY;
    }
    for (var x = 0u; x < band.width; x++) {
        let d = planes[row + x].x;
        let partner = partner_of(x, d);
        if (known(d) && partner >= 0) {
            let at = row + u32(partner);
            nearest[at] = max(nearest[at], d);
        }
    }
    for (var x = 0u; x < band.width; x++) {
        let d = planes[row + x].x;
        let partner = partner_of(x, d);
        let covered = (masked[id.x * band.words + (x >> 2u)] >> (8u * (x & 3u))) & 255u;
        let inside = known(d) && partner >= 0 && d >= hiding.disparity_min && d <= hiding.disparity_max;
        let seen = inside && nearest[row + u32(max(partner, 0))] <= d + hiding.tolerance;
        if (!seen || covered != 0u) {
            planes[row + x] = vec4<f32>(NO_DISPARITY, 0.0, 0.0, 0.0);
        }
    }
}
