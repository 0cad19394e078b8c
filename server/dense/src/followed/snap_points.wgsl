#import view
#import finite
#import surfel
#import graph
// Moves each point along the normal onto the plane of the surfel that its pixel shows, where that is the same surface.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> index_scale: u32;
// `surfels` is the number of points
@group(0) @binding(2) var<uniform> settings: GraphSettings;
@group(0) @binding(3) var<storage, read> shown: array<u32>;
@group(0) @binding(4) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> history: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> points: array<vec4<f32>>;

// Of one surface: this near to the plane, and within so many radii of the surfel's centre
const NEAR_M: f32 = 1.5e-3;
const RADII: f32 = 3.0;

@compute @workgroup_size(64)
fn snap_points(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= settings.surfels {
        return;
    }
    let point = points[id.x].xyz;
    let in_camera = transform_point(view.camera_from_world, point);
    let at = project(view.intrinsics, in_camera);
    let size = vec2<f32>(view.size);
    if !all_finite(in_camera) || in_camera.z < 1e-4 || !all(at > vec2<f32>(-0.5)) || !all(at < size - 0.5) {
        return;
    }
    let cell = vec2<u32>(clamp(round(at), vec2<f32>(0.0), size - 1.0)) * index_scale + index_scale / 2u;
    let stored = shown[cell.y * view.size.x * index_scale + cell.x];
    if stored == 0u || !is_stable(history[~stored].w) {
        return;
    }
    let surfel = geometry[~stored];
    let normal = orientation[~stored].xyz;
    let off = dot(normal, point - surfel.xyz);
    let moved = point - off * normal;
    if all_finite(moved) && abs(off) < NEAR_M && distance(moved, surfel.xyz) < RADII * surfel.w {
        points[id.x] = vec4<f32>(moved, points[id.x].w);
    }
}
