#import view
#import finite
// Follows patches of tissue from the keyframe to this picture: where the warp up to now has carried a patch and its
// neighbours is where its search starts and how it is distorted, and Gauss-Newton steps on the grey values (Lucas and
// Kanade; differences of brightness and contrast are free) find where it is. Patches that look like nothing, end nowhere,
// or are uncertain give no match. One invocation per patch.

@group(0) @binding(0) var<uniform> settings: FlowSettings;
@group(0) @binding(1) var<uniform> view: View;
// the keyframe's
@group(0) @binding(2) var<storage, read> depth_before: array<f32>;
// take_templates.wgsl
@group(0) @binding(3) var<storage, read> templates: array<vec4<f32>>;
// grey values, negative where the picture does not show the tissue
@group(0) @binding(4) var<storage, read> grey_now: array<f32>;
// per patch its place in world, m; w is 0 where it has none
@group(0) @binding(5) var<storage, read> tissue: array<vec4<f32>>;
// the keyframe's pixel, pixel; outside the picture where there is no match
@group(0) @binding(6) var<storage, read_write> matches: array<vec4<f32>>;

const NOWHERE = vec4<f32>(-2.0);
// A step shorter than this ends the search, px.
const SETTLED_PX = 0.02;
// No step goes farther, in sample distances.
const STEP_MAX = 2.0;
// Variance of the noise that is taken to be in every picture.
const NOISE = 1.0;
// A patch is not distorted by more than this.
const DISTORTION_MAX = 0.5;

// Where a patch is looked for: pixels now per pixel of the keyframe, and the middle.
struct Place {
    known: bool,
    distortion: mat2x2<f32>,
    middle: vec2<f32>,
}

// One linearisation about a shift.
struct Step {
    // whether enough of the patch can be compared
    usable: bool,
    way: vec2<f32>,
    // mean square of what is left, and the smaller eigenvalue of the normal matrix
    misfit: f32,
    contrast: f32,
}

fn depth_then(at: vec2<i32>) -> f32 {
    return depth_before[index_of(at)];
}

// Whether a pixel of the keyframe lies on the surface that its patch's centre shows.
fn is_own(centre: vec2<i32>, offset: vec2<i32>) -> bool {
    return on_surface(depth_then(centre), depth_then(centre + offset), offset, view.intrinsics.x);
}

// Between four pixels; negative where one of them does not show the tissue.
fn now(at: vec2<f32>) -> f32 {
    let corner = vec2<i32>(floor(at));
    let known = inside(corner) && inside(corner + 1);
    let safe = vec2<u32>(clamp(corner, vec2<i32>(0), max(vec2<i32>(view.size) - 2, vec2<i32>(0))));
    let first = safe.y * view.size.x + safe.x;
    let upper = vec2<f32>(grey_now[first], grey_now[first + 1u]);
    let lower = vec2<f32>(grey_now[first + view.size.x], grey_now[first + view.size.x + 1u]);
    let least = min(min(upper.x, upper.y), min(lower.x, lower.y));
    let share = at - floor(at);
    let rows = mix(upper, lower, share.y);
    return select(-1.0, mix(rows.x, rows.y, share.x), known && least >= 0.0);
}

// By the samples at distance `number`.
fn linearise(patch_number: u32, place: Place, number: u32) -> Step {
    let patches = settings.columns * settings.rows;
    let samples = samples_of(settings.radius);
    let spread = spread_of(number);
    var at = number * samples * patches + patch_number;
    var count = 0.0;
    var gradients = vec2<f32>(0.0);
    var error = 0.0;
    var square = 0.0;
    // grey values about the middle's, their squares, and their products with error and gradient
    let middle = templates[at + samples / 2u * patches].x;
    var level = 0.0;
    var levels = 0.0;
    var level_error = 0.0;
    var level_gradients = vec2<f32>(0.0);
    // xx, yy, xy
    var normal = vec3<f32>(0.0);
    var right = vec2<f32>(0.0);
    for (var v = -settings.radius; v <= settings.radius; v++) {
        for (var u = -settings.radius; u <= settings.radius; u++) {
            let then = templates[at];
            at += patches;
            let is_now = now(place.middle + place.distortion * vec2<f32>(spread * vec2<i32>(u, v)));
            if then.w == 0.0 || !(is_now >= 0.0) {
                continue;
            }
            let was = then.x;
            let gradient = then.yz;
            let off = is_now - was;
            count += 1.0;
            gradients += gradient;
            error += off;
            square += off * off;
            level += was - middle;
            levels += (was - middle) * (was - middle);
            level_error += (was - middle) * off;
            level_gradients += (was - middle) * gradient;
            normal += vec3<f32>(gradient * gradient, gradient.x * gradient.y);
            right += off * gradient;
        }
    }
    let side = f32(2 * settings.radius + 1);
    var step = Step(false, vec2<f32>(0.0), 0.0, 0.0);
    if count < 0.7 * side * side {
        return step;
    }
    // the mean difference of brightness is no motion's doing, nor is one in proportion to it
    normal -= vec3<f32>(gradients * gradients, gradients.x * gradients.y) / count;
    right -= gradients * (error / count);
    square -= error * error / count;
    levels -= level * level / count;
    level_error -= level * error / count;
    level_gradients -= gradients * (level / count);
    if levels > NOISE * count {
        normal -= vec3<f32>(level_gradients * level_gradients, level_gradients.x * level_gradients.y) / levels;
        right -= level_gradients * (level_error / levels);
        square -= level_error * level_error / levels;
    }
    let determinant = normal.x * normal.y - normal.z * normal.z;
    let half = 0.5 * (normal.x + normal.y);
    step.contrast = half - sqrt(max(half * half - determinant, 0.0));
    if step.contrast <= 1e-3 * count {
        return step;
    }
    let way = vec2<f32>(normal.z * right.y - normal.y * right.x, normal.z * right.x - normal.x * right.y) / determinant;
    step.way = place.distortion * (way * min(1.0, STEP_MAX * f32(spread) / max(length(way), 1e-6)));
    step.misfit = max(square, 0.0) / count;
    step.usable = is_finite(step.way.x) && is_finite(step.way.y);
    return step;
}

// Where the tissue of a patch is seen now; NOWHERE's first two where that is not known.
fn seen_at(number: u32) -> vec2<f32> {
    if tissue[number].w == 0.0 {
        return NOWHERE.xy;
    }
    let seen = transform_point(view.camera_from_world, tissue[number].xyz);
    let at = project(view.intrinsics, seen);
    let known = all_finite(seen) && seen.z > 1e-4 && is_finite(at.x) && is_finite(at.y);
    return select(NOWHERE.xy, at, known && inside(vec2<i32>(round(at))));
}

// What a pixel of the keyframe has become along one direction, by the neighbours that lie on the same surface.
fn stretched(centre: vec2<i32>, own: vec2<f32>, number: u32, neighbour: u32, sides: vec2<bool>, along: vec2<i32>) -> vec2<f32> {
    let step = i32(settings.spacing) * along;
    var ahead = NOWHERE.xy;
    if sides.y && is_own(centre, step) {
        ahead = seen_at(number + neighbour);
    }
    var behind = NOWHERE.xy;
    if sides.x && is_own(centre, -step) {
        behind = seen_at(number - neighbour);
    }
    let first = select(behind, own, behind.x < -1.0);
    let last = select(ahead, own, ahead.x < -1.0);
    let steps = select(1.0, 0.0, behind.x < -1.0) + select(1.0, 0.0, ahead.x < -1.0);
    let change = (last - first) / (max(steps, 1.0) * f32(settings.spacing));
    let undistorted = vec2<f32>(along);
    return select(undistorted, change, steps > 0.0 && distance(change, undistorted) < DISTORTION_MAX);
}

// Where the warp up to now has carried a patch.
fn expected(number: u32, centre: vec2<i32>) -> Place {
    let own = seen_at(number);
    if own.x < -1.0 {
        return Place(false, mat2x2<f32>(), own);
    }
    let column = number % settings.columns;
    let row = number / settings.columns;
    let across = stretched(centre, own, number, 1u, vec2<bool>(column > 0u, column + 1u < settings.columns), vec2<i32>(1, 0));
    let down = stretched(centre, own, number, settings.columns, vec2<bool>(row > 0u, row + 1u < settings.rows), vec2<i32>(0, 1));
    return Place(true, mat2x2<f32>(across, down), own);
}

// From coarse samples to fine ones.
fn follow(number: u32, centre: vec2<i32>) -> vec4<f32> {
    var place = expected(number, centre);
    if !place.known {
        return NOWHERE;
    }
    let first = place.middle;
    var last = Step(false, vec2<f32>(0.0), 0.0, 0.0);
    for (var distance_number = 0u; distance_number < SPREADS; distance_number++) {
        for (var i = 0u; i < settings.steps; i++) {
            last = linearise(number, place, distance_number);
            if !last.usable {
                break;
            }
            place.middle += last.way;
            if length(last.way) < SETTLED_PX {
                break;
            }
        }
    }
    let settled = last.usable && length(last.way) < 5.0 * SETTLED_PX && distance(place.middle, first) <= settings.reach_px;
    let fits = last.misfit <= settings.misfit_max * settings.misfit_max;
    let sure = last.misfit + NOISE <= settings.spread_max_px * settings.spread_max_px * last.contrast;
    return select(NOWHERE, vec4<f32>(vec2<f32>(centre), place.middle), settled && fits && sure);
}

@compute @workgroup_size(64)
fn follow_patches(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= settings.columns * settings.rows {
        return;
    }
    let centre = patch_centre(id.x);
    var found = NOWHERE;
    if settings.usable != 0u && inside(centre) {
        found = follow(id.x, centre);
    }
    matches[id.x] = found;
}
