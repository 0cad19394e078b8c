#import view
#import finite
// Follows patches of tissue from the last picture to this one: where depth and poses of then and now put a patch is where
// its search starts, and Gauss-Newton steps on the grey values (Lucas and Kanade; a difference of brightness is free) find
// where it is. Patches that look like nothing, end nowhere, or are uncertain give no match. One invocation per patch.

struct FlowSettings {
    // the grid of patches, and the pixels from one to the next
    columns: u32,
    rows: u32,
    spacing: u32,
    // 0 where the last picture is not what the model shows
    usable: u32,
    // half width of a patch in samples
    radius: i32,
    // steps at each of the three sample distances
    steps: u32,
    // px: largest standard deviation of a match, and largest way from where it was expected
    spread_max_px: f32,
    reach_px: f32,
    // grey levels: largest root mean square of what is left
    misfit_max: f32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> settings: FlowSettings;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> view_before: View;
@group(0) @binding(3) var<storage, read> depth_before: array<f32>;
// grey values, negative where a picture does not show the tissue
@group(0) @binding(4) var<storage, read> grey_before: array<f32>;
@group(0) @binding(5) var<storage, read> grey_now: array<f32>;
// previous pixel, pixel; outside the picture where there is no match
@group(0) @binding(6) var<storage, read_write> matches: array<vec4<f32>>;

const NOWHERE = vec4<f32>(-2.0);
// A step shorter than this ends the search, px.
const SETTLED_PX = 0.02;
// No step goes farther, in sample distances.
const STEP_MAX = 2.0;
// A sample lies on the surface of the patch's centre where its depth differs by no more than this share, and what such a
// slope makes of its distance.
const STEP_SHARE = 0.03;
const SLOPE_MAX = 1.5;
// Variance of the noise that is taken to be in every picture.
const NOISE = 1.0;

// One linearisation about a shift.
struct Step {
    // whether enough of the patch can be compared
    usable: bool,
    way: vec2<f32>,
    // mean square of what is left, and the smaller eigenvalue of the normal matrix
    misfit: f32,
    contrast: f32,
}

fn inside(at: vec2<i32>) -> bool {
    return all(at >= vec2<i32>(0)) && all(at < vec2<i32>(view.size));
}

fn depth_then(at: vec2<i32>) -> f32 {
    return depth_before[u32(at.y) * view.size.x + u32(at.x)];
}

// Tissue behind an edge moves by itself.
fn on_surface(centre_depth: f32, at: vec2<i32>, offset: vec2<i32>) -> bool {
    let way = length(vec2<f32>(offset)) / view.intrinsics.x;
    return abs(depth_then(at) - centre_depth) <= centre_depth * (STEP_SHARE + SLOPE_MAX * way);
}

fn then(at: vec2<i32>) -> f32 {
    return grey_before[u32(at.y) * view.size.x + u32(at.x)];
}

// Between four pixels; negative where one of them does not show the tissue.
fn now(at: vec2<f32>) -> f32 {
    let corner = vec2<i32>(floor(at));
    if !inside(corner) || !inside(corner + 1) {
        return -1.0;
    }
    let first = u32(corner.y) * view.size.x + u32(corner.x);
    let upper = vec2<f32>(grey_now[first], grey_now[first + 1u]);
    let lower = vec2<f32>(grey_now[first + view.size.x], grey_now[first + view.size.x + 1u]);
    if min(min(upper.x, upper.y), min(lower.x, lower.y)) < 0.0 {
        return -1.0;
    }
    let share = at - floor(at);
    let rows = mix(upper, lower, share.y);
    return mix(rows.x, rows.y, share.x);
}

// `spread` pixels lie between the samples, and as many to both sides of one between the values of its gradient.
fn linearise(centre: vec2<i32>, shift: vec2<f32>, spread: i32) -> Step {
    let depth = depth_then(centre);
    var count = 0.0;
    var gradients = vec2<f32>(0.0);
    var error = 0.0;
    var square = 0.0;
    // xx, yy, xy
    var normal = vec3<f32>(0.0);
    var right = vec2<f32>(0.0);
    for (var v = -settings.radius; v <= settings.radius; v++) {
        for (var u = -settings.radius; u <= settings.radius; u++) {
            let offset = spread * vec2<i32>(u, v);
            let at = centre + offset;
            if !inside(at - spread) || !inside(at + spread) || !on_surface(depth, at, offset) {
                continue;
            }
            let was = then(at);
            let across = vec2<f32>(then(at - vec2<i32>(spread, 0)), then(at + vec2<i32>(spread, 0)));
            let down = vec2<f32>(then(at - vec2<i32>(0, spread)), then(at + vec2<i32>(0, spread)));
            let is_now = now(vec2<f32>(at) + shift);
            if min(min(min(across.x, across.y), min(down.x, down.y)), min(was, is_now)) < 0.0 {
                continue;
            }
            let gradient = vec2<f32>(across.y - across.x, down.y - down.x) / f32(2 * spread);
            let off = is_now - was;
            count += 1.0;
            gradients += gradient;
            error += off;
            square += off * off;
            normal += vec3<f32>(gradient * gradient, gradient.x * gradient.y);
            right += off * gradient;
        }
    }
    let side = f32(2 * settings.radius + 1);
    var step = Step(false, vec2<f32>(0.0), 0.0, 0.0);
    if count < 0.7 * side * side {
        return step;
    }
    // the mean difference of brightness is no motion's doing
    normal -= vec3<f32>(gradients * gradients, gradients.x * gradients.y) / count;
    right -= gradients * (error / count);
    let determinant = normal.x * normal.y - normal.z * normal.z;
    let half = 0.5 * (normal.x + normal.y);
    step.contrast = half - sqrt(max(half * half - determinant, 0.0));
    if step.contrast <= 1e-3 * count {
        return step;
    }
    let way = vec2<f32>(normal.z * right.y - normal.y * right.x, normal.z * right.x - normal.x * right.y) / determinant;
    step.way = way * min(1.0, STEP_MAX * f32(spread) / max(length(way), 1e-6));
    step.misfit = max(square - error * error / count, 0.0) / count;
    step.usable = is_finite(step.way.x) && is_finite(step.way.y);
    return step;
}

// Where depth and poses put a pixel of the last picture; NOWHERE's first two where they do not know.
fn expected(centre: vec2<i32>) -> vec2<f32> {
    let depth = depth_then(centre);
    if !is_finite(depth) || depth <= 0.0 {
        return NOWHERE.xy;
    }
    let point = transform_point(view_before.world_from_camera, ray(view.intrinsics, vec2<f32>(centre)) * depth);
    let seen = transform_point(view.camera_from_world, point);
    let at = project(view.intrinsics, seen);
    let known = all_finite(seen) && seen.z > 1e-4 && is_finite(at.x) && is_finite(at.y);
    return select(NOWHERE.xy, at, known && inside(vec2<i32>(round(at))));
}

// From coarse samples to fine ones.
fn follow(centre: vec2<i32>) -> vec4<f32> {
    let start = expected(centre);
    if start.x < -1.0 {
        return NOWHERE;
    }
    let first = start - vec2<f32>(centre);
    var shift = first;
    var last = Step(false, vec2<f32>(0.0), 0.0, 0.0);
    for (var spread = 4; spread >= 1; spread /= 2) {
        for (var i = 0u; i < settings.steps; i++) {
            last = linearise(centre, shift, spread);
            if !last.usable {
                break;
            }
            shift += last.way;
            if length(last.way) < SETTLED_PX {
                break;
            }
        }
    }
    let settled = last.usable && length(last.way) < 5.0 * SETTLED_PX && distance(shift, first) <= settings.reach_px;
    let fits = last.misfit <= settings.misfit_max * settings.misfit_max;
    let sure = last.misfit + NOISE <= settings.spread_max_px * settings.spread_max_px * last.contrast;
    return select(NOWHERE, vec4<f32>(vec2<f32>(centre), vec2<f32>(centre) + shift), settled && fits && sure);
}

@compute @workgroup_size(64)
fn follow_patches(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= settings.columns * settings.rows {
        return;
    }
    let cell = vec2<u32>(id.x % settings.columns, id.x / settings.columns);
    let centre = vec2<i32>(cell * settings.spacing + settings.spacing / 2u);
    var found = NOWHERE;
    if settings.usable != 0u && inside(centre) {
        found = follow(centre);
    }
    matches[id.x] = found;
}
