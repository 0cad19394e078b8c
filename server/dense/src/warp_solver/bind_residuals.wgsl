#import view
#import finite
#import surfel
#import graph
#import near_nodes
#import binding
#import held_out
// Finds the residuals' model points and the nodes that move them. A data residual is the surfel that the index map shows
// at a pixel of the grid; blocks held out may give none. Counts how many residuals of each run each node takes part in.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> graph: GraphSettings;
@group(0) @binding(2) var<uniform> settings: SolverSettings;
@group(0) @binding(3) var<uniform> index_scale: u32;
@group(0) @binding(4) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> node_heads: array<u32>;
@group(0) @binding(6) var<storage, read> node_next: array<u32>;
@group(0) @binding(7) var<storage, read> shown: array<u32>;
@group(0) @binding(8) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read> depth: array<f32>;
@group(0) @binding(11) var<storage, read> sigma_z: array<f32>;
// previous pixel, pixel
@group(0) @binding(12) var<storage, read> matches: array<vec4<f32>>;
@group(0) @binding(13) var<storage, read> depth_before: array<f32>;
@group(0) @binding(14) var<storage, read> view_before: View;
// per patch its place in world, m; w is 0 where it has none
@group(0) @binding(15) var<storage, read> tissue: array<vec4<f32>>;
@group(0) @binding(16) var<storage, read_write> anchors: array<vec4<u32>>;
@group(0) @binding(17) var<storage, read_write> weights: array<vec4<f32>>;
// model point in world (m), 1 for data, 2 for a match, 0 for none
@group(0) @binding(18) var<storage, read_write> points: array<vec4<f32>>;
// data: the surfel's normal in world
@group(0) @binding(19) var<storage, read_write> normals: array<vec4<f32>>;
// match: the plane in the camera, normal and offset (mm)
@group(0) @binding(20) var<storage, read_write> planes: array<vec4<f32>>;
// match: weight and Huber's threshold
@group(0) @binding(21) var<storage, read_write> robust: array<vec2<f32>>;
// per node and run
@group(0) @binding(22) var<storage, read_write> run_counts: array<atomic<u32>>;
@group(0) @binding(23) var<storage, read_write> places: array<vec4<u32>>;

// The surfel that a pixel shows, NO_NODE where none.
fn surfel_at(pixel: vec2<u32>) -> u32 {
    let cell = pixel * index_scale + index_scale / 2u;
    return ~shown[cell.y * view.size.x * index_scale + cell.x];
}

fn inside(at: vec2<f32>) -> bool {
    return all(at > vec2<f32>(-0.5)) && all(at < vec2<f32>(view.size) - 0.5);
}

fn nearest_pixel(at: vec2<f32>) -> vec2<u32> {
    return vec2<u32>(clamp(round(at), vec2<f32>(0.0), vec2<f32>(view.size) - 1.0));
}

fn attach(residual: u32, binding: NodeBinding, point: vec3<f32>, kind: f32) {
    if binding.slots.x == NO_NODE {
        return;
    }
    let run = run_of(residual, settings);
    var place = vec4<u32>(0u);
    for (var corner = 0u; corner < 4u; corner++) {
        if binding.slots[corner] != NO_NODE {
            place[corner] = atomicAdd(&run_counts[RUNS_OF_RESIDUALS * binding.slots[corner] + run], 1u);
        }
    }
    anchors[residual] = binding.slots;
    weights[residual] = binding.weights;
    places[residual] = place;
    points[residual] = vec4<f32>(point, kind);
}

fn clear_residual(residual: u32) {
    anchors[residual] = vec4<u32>(NO_NODE);
    weights[residual] = vec4<f32>(0.0);
    points[residual] = vec4<f32>(0.0);
    normals[residual] = vec4<f32>(0.0);
    planes[residual] = vec4<f32>(0.0);
    robust[residual] = vec2<f32>(0.0);
}

fn attach_pixel(residual: u32) {
    let pixel = vec2<u32>(residual % settings.columns, residual / settings.columns) * settings.stride;
    if settings.hold_out != 0u && is_held_out(pixel) {
        return;
    }
    let slot = surfel_at(pixel);
    if slot == NO_NODE || !all_finite(orientation[slot].xyz) {
        return;
    }
    let point = geometry[slot].xyz;
    normals[residual] = vec4<f32>(orientation[slot].xyz, 0.0);
    if all_finite(point) {
        attach(residual, bind_to_nodes(point), point, 1.0);
    }
}

// The model point that was at a match's old pixel, from the depth then, drawn onto the surfel that shows it now.
fn matched_point(previous: vec2<f32>) -> vec4<f32> {
    if !inside(previous) {
        return vec4<f32>(0.0);
    }
    let pixel = nearest_pixel(previous);
    let then = depth_before[pixel.y * view.size.x + pixel.x];
    if !is_finite(then) || then <= 0.0 {
        return vec4<f32>(0.0);
    }
    let point = transform_point(view_before.world_from_camera, ray(view.intrinsics, previous) * then);
    let now = transform_point(view.camera_from_world, point);
    let at = project(view.intrinsics, now);
    if !all_finite(now) || now.z < 1e-4 || !inside(at) {
        return vec4<f32>(0.0);
    }
    let slot = surfel_at(nearest_pixel(at));
    if slot == NO_NODE {
        return vec4<f32>(0.0);
    }
    let off = dot(orientation[slot].xyz, point - geometry[slot].xyz);
    let snapped = point - off * orientation[slot].xyz;
    let belongs = all_finite(snapped) && distance(snapped, geometry[slot].xyz) < settings.gate_m
        && abs(off) < 0.25 * settings.gate_m;
    return vec4<f32>(snapped, select(0.0, 1.0, belongs));
}

// Three residuals: along the new pixel's ray, where depth is uncertain, and across it twice.
fn attach_match(number: u32) {
    let pair = matches[number];
    let of_patch = number < settings.patches;
    var point = vec4<f32>(0.0);
    if of_patch {
        point = tissue[number];
    } else {
        point = matched_point(pair.xy);
    }
    if point.w == 0.0 || !all_finite(point.xyz) || !inside(pair.zw) {
        return;
    }
    let pixel = nearest_pixel(pair.zw);
    if settings.hold_out != 0u && is_held_out(pixel) {
        return;
    }
    let weight = select(settings.w_corr, settings.w_flow, of_patch);
    let index = pixel.y * view.size.x + pixel.x;
    let spread = max(sigma_z[index] / settings.reference_sigma_m, 1.0);
    if !is_finite(depth[index]) || depth[index] <= 0.0 || !is_finite(spread) {
        return;
    }
    let target_mm = MM * ray(view.intrinsics, pair.zw) * depth[index];
    let along = normalize(target_mm);
    let across = normalize(cross(along, vec3<f32>(0.0, 1.0, 0.0)));
    let directions = array<vec3<f32>, 3>(along, across, cross(along, across));
    let first = settings.columns * settings.rows + 3u * number;
    let binding = bind_to_nodes(point.xyz);
    for (var i = 0u; i < 3u; i++) {
        let relative = select(1.0, spread, i == 0u);
        planes[first + i] = vec4<f32>(directions[i], dot(directions[i], target_mm));
        robust[first + i] = vec2<f32>(weight / (relative * relative), settings.match_huber_mm * relative);
        attach(first + i, binding, point.xyz, 2.0);
    }
}

@compute @workgroup_size(64)
fn bind_residuals(@builtin(global_invocation_id) id: vec3<u32>) {
    let grid = settings.columns * settings.rows;
    if id.x < grid {
        clear_residual(id.x);
        attach_pixel(id.x);
    } else if id.x < grid + settings.matches {
        let number = id.x - grid;
        for (var i = 0u; i < 3u; i++) {
            clear_residual(grid + 3u * number + i);
        }
        attach_match(number);
    }
}
