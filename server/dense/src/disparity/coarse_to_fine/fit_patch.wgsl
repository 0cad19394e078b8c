// A planar patch through what its pixels ask for (pool_targets.wgsl): the weighted plane through those pixels whose
// present disparity lies within a gate of the plane that the pixel has. A pixel whose patch finds no plane, or one too
// far from its disparity, keeps its plane.
//
// targets: per pixel (pool_targets.wgsl), unpadded rows. planes: disparity, slopes along x and y, standard deviation; changed in
// place. The window has 5 x 5 pixels, `stride` apart. Pixels of a block of 2 x 2 that lie within the gate of one plane
// share its patch; of more than two planes in a block the others keep theirs. One invocation per block.

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
@group(0) @binding(2) var<storage, read> targets: array<PatchTarget>;
@group(0) @binding(3) var<storage, read_write> planes: array<vec4<f32>>;

const WINDOW = 25.0;
const INLIERS_MIN = 6.0;
// Planes that a block may have.
const SURFACES = 2u;

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
    let wish = wish_of(point);
    let off = point.disparity - plane.x;
    let on_plane = column == inner && abs(off - dot(plane.yz, p)) <= patch_fit.gate;
    let weight = select(0.0, wish.y, on_plane);
    let z = select(0.0, off + wish.x, on_plane);
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

// What a patch's pixels say of it: whether they form a plane, and that plane, in the patch's own frame.
struct Answer {
    is_plane: bool,
    shift: f32,
    slope: vec2<f32>,
    sigma: f32,
}

fn solve(sums: Sums) -> Answer {
    let weight = max(sums.weight, 1.0e-12);
    let mean = sums.first / weight;
    let xx = sums.xx - weight * mean.x * mean.x;
    let xy = sums.xy - weight * mean.x * mean.y;
    let yy = sums.yy - weight * mean.y * mean.y;
    let with_target = sums.with_target - (weight * mean.z) * mean;
    let determinant = xx * yy - xy * xy;
    let is_spanned = sums.count >= INLIERS_MIN && determinant > 0.001 * weight * weight;
    let safe = select(1.0, determinant, is_spanned);
    let slope = vec2<f32>(yy * with_target.x - xy * with_target.y, xx * with_target.y - xy * with_target.x) / safe;
    let shift = mean.z - dot(slope, mean.xy);
    let square = max(with_target.z - dot(slope, with_target.xy), 0.0) / weight;
    let missing = 1.0 - sums.count / WINDOW;
    let variance = patch_fit.sigma_floor * patch_fit.sigma_floor
        + patch_fit.residual_factor * patch_fit.residual_factor * square
        + patch_fit.noise_levels * patch_fit.noise_levels / weight
        + patch_fit.missing_factor * patch_fit.missing_factor * missing * missing;
    return Answer(is_spanned && abs(shift) <= patch_fit.shift_max, shift, slope, sqrt(variance));
}

// Column and row of pixel `corner` of a block.
fn at_corner(block: vec2<u32>, corner: u32) -> vec2<u32> {
    return 2u * block + vec2<u32>(corner & 1u, corner >> 1u);
}

fn disparity_at(block: vec2<u32>, corner: u32) -> f32 {
    let at = at_corner(block, corner);
    if (at.x >= band.width || at.y >= band.height) {
        return NO_DISPARITY;
    }
    return planes[at.y * band.width + at.x].x;
}

@compute @workgroup_size(64)
fn fit_patch(@builtin(global_invocation_id) id: vec3<u32>) {
    let block = id.xy;
    if (2u * block.x >= band.width || 2u * block.y >= band.height) {
        return;
    }
    let own = vec4<f32>(disparity_at(block, 0u), disparity_at(block, 1u), disparity_at(block, 2u),
        disparity_at(block, 3u));
    var open = own > vec4<f32>(-1.0e5);
    for (var surface = 0u; surface < SURFACES && any(open); surface++) {
        let first = select(select(select(3u, 2u, open.z), 1u, open.y), 0u, open.x);
        let from_block = at_corner(block, first);
        let plane = planes[from_block.y * band.width + from_block.x].xyz;
        let answer = solve(gather(i32(from_block.x), i32(from_block.y), plane));
        let across = vec4<f32>(0.0, 1.0, 0.0, 1.0) - f32(first & 1u);
        let down = vec4<f32>(0.0, 0.0, 1.0, 1.0) - f32(first >> 1u);
        let off = abs(own - (plane.x + plane.y * across + plane.z * down));
        var joins = open & (off <= vec4<f32>(patch_fit.gate));
        joins[first] = true;
        let fitted = plane.x + answer.shift + answer.slope.x * across + answer.slope.y * down;
        for (var corner = 0u; corner < 4u; corner++) {
            if (joins[corner] && answer.is_plane) {
                let at = at_corner(block, corner);
                planes[at.y * band.width + at.x] = vec4<f32>(fitted[corner], answer.slope, answer.sigma);
            }
        }
        open = open & !joins;
    }
}
