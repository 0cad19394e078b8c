#import finite
#import surfel
#import graph
#import near_nodes
#import binding
// Growth, pass 1: each surfel seen in this frame that has no node within the spacing claims its cell of the sampling
// grid; the lowest slot wins. All others tell the node nearest to them that it is held. There are a hundred surfels to a
// node, so in each frame only every 4th of those seen takes its turn, and every 32nd of the others.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> node_heads: array<u32>;
@group(0) @binding(3) var<storage, read> node_next: array<u32>;
@group(0) @binding(4) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> history: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> held: array<u32>;
// per place: the inverted slot of the winner, 0 where none
@group(0) @binding(7) var<storage, read_write> claims: array<atomic<u32>>;

const SEEN_TICKS: u32 = 4u;
const SWEEP_TICKS: u32 = 32u;

@compute @workgroup_size(64)
fn claim_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= graph.surfels || !is_alive(history[slot].w) {
        return;
    }
    let seen = history[slot].y == graph.frame;
    let turns = select(SWEEP_TICKS, SEEN_TICKS, seen);
    if slot % turns != graph.tick % turns {
        return;
    }
    let point = geometry[slot].xyz;
    if !all_finite(point) {
        return;
    }
    let near = bind_to_nodes(point);
    if near.slots.x != NO_NODE {
        held[near.slots.x] = graph.tick;
    }
    if seen && near.nearest_m > graph.spacing_m {
        let cell = cell_of(point, graph.claim_cells_per_metre);
        atomicMax(&claims[cell_hash(cell, graph.tick) & graph.claim_mask], ~slot);
    }
}
