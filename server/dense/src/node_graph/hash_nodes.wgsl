#import finite
#import surfel
#import graph
// Hangs each node into the list of its cell's bucket. The order within a list differs from run to run and means nothing.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read_write> node_heads: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> node_next: array<u32>;

@compute @workgroup_size(64)
fn hash_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) || !is_node(nodes[slot]) || !all_finite(node_point(nodes[slot])) {
        return;
    }
    let cell = cell_of(node_point(nodes[slot]), graph.cells_per_metre);
    node_next[slot] = atomicExchange(&node_heads[node_bucket(cell, graph.bucket_mask)], slot + 1u);
}
