// A planar patch through what its pixels ask for (pool_targets.wgsl): the weighted plane through those pixels whose
// present disparity lies within a gate of the plane that the pixel has. A pixel whose patch finds no plane, or one too
// far from its disparity, keeps its plane.
//
// targets: d, z, w per pixel, unpadded rows. planes: disparity, slopes along x and y, standard deviation; changed in
// place. The window has 5 x 5 pixels, `stride` apart. One invocation per pixel.

struct Patch {
    stride: i32,
    // px: gate about the present plane
    gate: f32,
    // px: a plane farther from the pixel's own disparity is not taken
    shift_max: f32,
    // standard deviation: floor, and factors of the residual, of the inverse root of the information, and of the
    // share of the window that is not on the plane
    sigma_floor: f32,
    residual_factor: f32,
    noise_levels: f32,
    missing_factor: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> patch_fit: Patch;
@group(0) @binding(2) var<storage, read> targets: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> planes: array<vec4<f32>>;

const WINDOW = 25.0;
const INLIERS_MIN = 6.0;

// Of the pixels on the plane: their number, weights, weighted positions and targets, weighted products.
struct Sums {
    count: f32,
    weight: f32,
    first: vec3<f32>,
    xx: f32,
    xy: f32,
    yy: f32,
    with_target: vec3<f32>,
}

// Adds the pixel at `column`, `p` away from the centre; targets count from the plane's value there.
fn add(sums: ptr<function, Sums>, row: u32, column: i32, p: vec2<f32>, plane: vec3<f32>) {
    let inner = clamp(column, 0, i32(band.width) - 1);
    let point = targets[row + u32(inner)];
    let on_plane = column == inner && abs(point.x - plane.x - dot(plane.yz, p)) <= patch_fit.gate;
    let weight = select(0.0, point.z, on_plane);
    let z = select(0.0, point.y - plane.x, on_plane);
    (*sums).count += select(0.0, 1.0, on_plane);
    (*sums).weight += weight;
    (*sums).first += weight * vec3<f32>(p, z);
    (*sums).xx += weight * p.x * p.x;
    (*sums).xy += weight * p.x * p.y;
    (*sums).yy += weight * p.y * p.y;
    (*sums).with_target += (weight * z) * vec3<f32>(p, z);
}

fn gather(x: i32, y: i32, plane: vec3<f32>) -> Sums {
    var sums = Sums(0.0, 0.0, vec3<f32>(0.0), 0.0, 0.0, 0.0, vec3<f32>(0.0));
    let stride = patch_fit.stride;
    let step = f32(stride);
    for (var v = -2; v <= 2; v++) {
        let y_at = y + v * stride;
        if (y_at >= 0 && y_at < i32(band.height)) {
            let row = u32(y_at) * band.width;
            let down = f32(v) * step;
            add(&sums, row, x - 2 * stride, vec2<f32>(-2.0 * step, down), plane);
            add(&sums, row, x - stride, vec2<f32>(-step, down), plane);
            add(&sums, row, x, vec2<f32>(0.0, down), plane);
            add(&sums, row, x + stride, vec2<f32>(step, down), plane);
            add(&sums, row, x + 2 * stride, vec2<f32>(2.0 * step, down), plane);
        }
    }
    return sums;
}

@compute @workgroup_size(64)
fn fit_patch(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let index = id.y * band.width + id.x;
    let own = planes[index].xyz;
    if (!known(own.x)) {
        return;
    }
    let sums = gather(i32(id.x), i32(id.y), own);
    let weight = max(sums.weight, 1.0e-12);
    let mean = sums.first / weight;
    let xx = sums.xx - weight * mean.x * mean.x;
    let xy = sums.xy - weight * mean.x * mean.y;
    let yy = sums.yy - weight * mean.y * mean.y;
    let with_target = sums.with_target - (weight * mean.z) * mean;
    let determinant = xx * yy - xy * xy;
    if (sums.count < INLIERS_MIN || !(determinant > 0.001 * weight * weight)) {
        return;
    }
    let slope = vec2<f32>(yy * with_target.x - xy * with_target.y, xx * with_target.y - xy * with_target.x) / determinant;
    let shift = mean.z - dot(slope, mean.xy);
    if (!(abs(shift) <= patch_fit.shift_max)) {
        return;
    }
    let square = max(with_target.z - dot(slope, with_target.xy), 0.0) / weight;
    let missing = 1.0 - sums.count / WINDOW;
    let variance = patch_fit.sigma_floor * patch_fit.sigma_floor
        + patch_fit.residual_factor * patch_fit.residual_factor * square
        + patch_fit.noise_levels * patch_fit.noise_levels / weight
        + patch_fit.missing_factor * patch_fit.missing_factor * missing * missing;
    planes[index] = vec4<f32>(own.x + shift, slope, sqrt(variance));
}
