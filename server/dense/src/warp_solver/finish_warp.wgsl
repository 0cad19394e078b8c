#import view
#import finite
#import surfel
#import graph
#import fusion
// Hands the solution over: the warp of each node in metres, and the corrected view. What is not finite stays at
// rest, and so does all in a frame that is not to be fused.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> state: SolverState;
@group(0) @binding(2) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> estimates: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> results: array<u32>;
@group(0) @binding(5) var<storage, read_write> transforms: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> refined: View;

fn refine_view() {
    refined = view;
    let half = 3u * state.present;
    var correction: array<vec4<f32>, 3>;
    var usable = results[ACCEPTED] != 0u;
    for (var row = 0u; row < 3u; row++) {
        correction[row] = vec4<f32>(state.poses[half + row].xyz, state.poses[half + row].w / MM);
        usable = usable && all_finite(correction[row].xyz) && is_finite(correction[row].w);
    }
    if !usable {
        return;
    }
    for (var row = 0u; row < 3u; row++) {
        let c = correction[row];
        let turned = c.x * view.camera_from_world[0] + c.y * view.camera_from_world[1]
            + c.z * view.camera_from_world[2];
        refined.camera_from_world[row] = turned + vec4<f32>(0.0, 0.0, 0.0, c.w);
    }
    // its inverse: the transpose, and the camera's centre
    let a = refined.camera_from_world[0];
    let b = refined.camera_from_world[1];
    let c = refined.camera_from_world[2];
    for (var row = 0u; row < 3u; row++) {
        let axis = vec3<f32>(a[row], b[row], c[row]);
        refined.world_from_camera[row] = vec4<f32>(axis, -dot(axis, vec3<f32>(a.w, b.w, c.w)));
    }
}

@compute @workgroup_size(64)
fn finish_warp(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot == 0u {
        refine_view();
    }
    if slot >= arrayLength(&nodes) {
        return;
    }
    let half = 3u * (state.present * arrayLength(&nodes) + slot);
    let rows = array<vec4<f32>, 3>(estimates[half], estimates[half + 1u], estimates[half + 2u]);
    let usable = results[ACCEPTED] != 0u && all_finite(rows[0].xyz) && all_finite(rows[1].xyz) && all_finite(rows[2].xyz)
        && all_finite(vec3<f32>(rows[0].w, rows[1].w, rows[2].w));
    for (var row = 0u; row < 3u; row++) {
        var identity = vec4<f32>(0.0);
        identity[row] = 1.0;
        transforms[3u * slot + row] = select(identity, vec4<f32>(rows[row].xyz, rows[row].w / MM), usable);
    }
}
