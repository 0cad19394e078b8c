#import finite
#import surfel
#import graph
#import near_nodes
#import binding
#import warp
// Moves surfels by their nodes (Eq. TransformationFomulation, the bracket): v' = sum w_j (A_j (v - g_j) + g_j + t_j),
// n' = sum w_j A_j^-T n, normalised. What would not be finite stays where it is.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> node_heads: array<u32>;
@group(0) @binding(3) var<storage, read> node_next: array<u32>;
@group(0) @binding(4) var<storage, read> transforms: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> stirred: array<u32>;
// w is 0 where the slot is not to be moved
@group(0) @binding(6) var<storage, read> state: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> geometry: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> orientation: array<vec4<f32>>;

// What one node makes of a surfel, times its weight.
struct Share {
    point: vec3<f32>,
    normal: vec3<f32>,
}

fn moved_by(slot: u32, weight: f32, point: vec3<f32>, normal: vec3<f32>) -> Share {
    if slot == NO_NODE {
        return Share(vec3<f32>(0.0), vec3<f32>(0.0));
    }
    let rows = rows_of(slot);
    return Share(weight * carried_by(rows, node_point(nodes[slot]), point), weight * turned_by(rows, normal));
}

@compute @workgroup_size(64)
fn move_surfels(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= graph.surfels || state[slot].w == 0u {
        return;
    }
    let point = geometry[slot].xyz;
    let cell = cell_of(point, graph.cells_per_metre);
    if !all_finite(point) || stirred[node_bucket(cell, graph.bucket_mask)] == 0u {
        return;
    }
    let binding = bind_to_nodes(point);
    let facing = orientation[slot];
    let a = moved_by(binding.slots.x, binding.weights.x, point, facing.xyz);
    let b = moved_by(binding.slots.y, binding.weights.y, point, facing.xyz);
    let c = moved_by(binding.slots.z, binding.weights.z, point, facing.xyz);
    let d = moved_by(binding.slots.w, binding.weights.w, point, facing.xyz);
    let moved = a.point + b.point + c.point + d.point;
    let normal = normalize(a.normal + b.normal + c.normal + d.normal);
    if binding.slots.x != NO_NODE && all_finite(moved) && all_finite(normal) {
        geometry[slot] = vec4<f32>(moved, geometry[slot].w);
        orientation[slot] = vec4<f32>(normal, facing.w);
    }
}
