#import finite
#import surfel
#import graph
// Marks the cells within reach of a node that moves anything, so that surfels elsewhere need not look for their nodes.
// Cells that share a bucket share its mark, at no harm.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> transforms: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> stirred: array<u32>;

fn is_identity(slot: u32) -> bool {
    return all(transforms[3u * slot] == vec4<f32>(1.0, 0.0, 0.0, 0.0))
        && all(transforms[3u * slot + 1u] == vec4<f32>(0.0, 1.0, 0.0, 0.0))
        && all(transforms[3u * slot + 2u] == vec4<f32>(0.0, 0.0, 1.0, 0.0));
}

@compute @workgroup_size(64)
fn stir_cells(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) || !is_node(nodes[slot]) || !all_finite(node_point(nodes[slot])) {
        return;
    }
    if is_identity(slot) {
        return;
    }
    let home = cell_of(node_point(nodes[slot]), graph.cells_per_metre);
    for (var around = 0; around < 27; around++) {
        let cell = home + vec3<i32>(around % 3, around / 3 % 3, around / 9) - 1;
        stirred[node_bucket(cell, graph.bucket_mask)] = 1u;
    }
}
