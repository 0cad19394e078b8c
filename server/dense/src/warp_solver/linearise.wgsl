#import view
#import finite
#import surfel
#import graph
// Associates each data residual anew (Algorithm 1: back-projection, point to plane), and leaves for every residual its
// value and gradient at the present estimate: the residual is n . (x - P), linear in the nodes with gradient
// w_j (R^T n) (x) [v - g_j; 1].

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: SolverSettings;
@group(0) @binding(2) var<storage, read> state: SolverState;
@group(0) @binding(3) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> estimates: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> anchors: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> depth: array<f32>;
@group(0) @binding(10) var<storage, read> sigma_z: array<f32>;
@group(0) @binding(11) var<storage, read> seen_normals: array<vec4<f32>>;
// plane in the camera, normal and offset (mm): written for data, read for matches
@group(0) @binding(12) var<storage, read_write> planes: array<vec4<f32>>;
@group(0) @binding(13) var<storage, read_write> robust: array<vec2<f32>>;
// gradient direction in world, weight of the square (0: no residual)
@group(0) @binding(14) var<storage, read_write> gradients: array<vec4<f32>>;
// point in the camera (mm), residual (mm)
@group(0) @binding(15) var<storage, read_write> in_camera: array<vec4<f32>>;

fn camera_normal(direction: vec3<f32>) -> vec3<f32> {
    let turned = rotate(view.camera_from_world, direction);
    let half = 3u * state.present;
    return vec3<f32>(dot(state.poses[half].xyz, turned), dot(state.poses[half + 1u].xyz, turned),
        dot(state.poses[half + 2u].xyz, turned));
}

fn world_direction(in_camera_frame: vec3<f32>) -> vec3<f32> {
    let half = 3u * state.present;
    let before = in_camera_frame.x * state.poses[half].xyz + in_camera_frame.y * state.poses[half + 1u].xyz
        + in_camera_frame.z * state.poses[half + 2u].xyz;
    return rotate(view.world_from_camera, before);
}

// Finds the measured plane that a data residual's point falls on.
fn associate(residual: u32, point_mm: vec3<f32>) {
    robust[residual] = vec2<f32>(0.0);
    let at = project(view.intrinsics, point_mm);
    let size = vec2<f32>(view.size);
    if point_mm.z < 0.1 || !all(at > vec2<f32>(-0.5)) || !all(at < size - 0.5) {
        return;
    }
    let pixel = vec2<u32>(clamp(round(at), vec2<f32>(0.0), size - 1.0));
    let index = pixel.y * view.size.x + pixel.x;
    let measured = depth[index];
    let sigma = sigma_z[index];
    let normal = seen_normals[index];
    if !(is_finite(measured) && is_finite(sigma) && all_finite(normal.xyz)) {
        return;
    }
    if measured <= 0.0 || sigma <= 0.0 || normal.w == 0.0 {
        return;
    }
    let seen_mm = MM * measured * ray(view.intrinsics, vec2<f32>(pixel));
    let facing = dot(camera_normal(normals[residual].xyz), normal.xyz);
    if distance(seen_mm, point_mm) > MM * settings.gate_m || !(facing > settings.angle_cos_min) {
        return;
    }
    let spread = max(sigma / settings.reference_sigma_m, 1.0);
    planes[residual] = vec4<f32>(normal.xyz, dot(normal.xyz, seen_mm));
    robust[residual] = vec2<f32>(settings.w_data / (spread * spread), settings.huber_mm * spread);
}

@compute @workgroup_size(64)
fn linearise(@builtin(global_invocation_id) id: vec3<u32>) {
    let residual = id.x;
    if residual >= residual_count(settings) || state.done != 0u || state.fresh == 0u {
        return;
    }
    gradients[residual] = vec4<f32>(0.0);
    in_camera[residual] = vec4<f32>(0.0);
    let kind = points[residual].w;
    if kind == 0.0 {
        return;
    }
    let point_mm = corrected(state.present, MM * transform_point(view.camera_from_world, warped(residual, state.present)));
    if !all_finite(point_mm) {
        robust[residual] = vec2<f32>(0.0);
        return;
    }
    if kind == 1.0 {
        associate(residual, point_mm);
    }
    let plane = planes[residual];
    let value = dot(plane.xyz, point_mm) - plane.w;
    gradients[residual] = vec4<f32>(world_direction(plane.xyz), huber(value, robust[residual]).y);
    in_camera[residual] = vec4<f32>(point_mm, value);
}
