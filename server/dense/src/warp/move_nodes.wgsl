#import finite
#import graph
#import surfel
// Moves each node by its own t, and composes its warp with those before: A := A A_before, t := t_before + t.

@group(0) @binding(0) var<storage, read_write> nodes: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> transforms: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> travelled: array<vec4<f32>>;

@compute @workgroup_size(64)
fn move_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) || !is_node(nodes[slot]) {
        return;
    }
    let step = array<vec4<f32>, 3>(transforms[3u * slot], transforms[3u * slot + 1u], transforms[3u * slot + 2u]);
    let moved = node_point(nodes[slot]) + vec3<f32>(step[0].w, step[1].w, step[2].w);
    if !all_finite(moved) {
        return;
    }
    let before = array<vec4<f32>, 3>(travelled[3u * slot], travelled[3u * slot + 1u], travelled[3u * slot + 2u]);
    for (var row = 0u; row < 3u; row++) {
        let a = step[row];
        let turned = a.x * before[0].xyz + a.y * before[1].xyz + a.z * before[2].xyz;
        travelled[3u * slot + row] = vec4<f32>(turned, before[row].w + a.w);
    }
    nodes[slot] = vec4<u32>(bitcast<vec3<u32>>(moved), nodes[slot].w);
}
