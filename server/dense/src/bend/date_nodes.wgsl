#import finite
#import surfel
#import graph
#import near_nodes
#import binding
// When was the tissue about each node last seen? The newest frame of the surfels whose nearest node it is.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> node_heads: array<u32>;
@group(0) @binding(3) var<storage, read> node_next: array<u32>;
@group(0) @binding(4) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> history: array<vec4<u32>>;
// per node: that frame plus one, 0 where it has no surfel
@group(0) @binding(6) var<storage, read_write> dates: array<atomic<u32>>;

@compute @workgroup_size(64)
fn date_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= graph.surfels || !is_alive(history[slot].w) || !all_finite(geometry[slot].xyz) {
        return;
    }
    let nearest = bind_to_nodes(geometry[slot].xyz).slots.x;
    if nearest != NO_NODE {
        atomicMax(&dates[nearest], history[slot].y + 1u);
    }
}
