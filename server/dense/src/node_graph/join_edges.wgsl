#import graph
#import surfel
// Makes edges symmetric. A node accepts, of those that count it among their nearest, the 12 lowest slots; an edge is a
// node's bond to one of its nearest that accepts it, or to one that it accepts. Edges are listed by ascending slot.

@group(0) @binding(0) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> nearest: array<u32>;
@group(0) @binding(2) var<storage, read> follower_counts: array<u32>;
@group(0) @binding(3) var<storage, read> followers: array<u32>;
@group(0) @binding(4) var<storage, read_write> edges: array<u32>;

const NEAREST: u32 = 8u;
const ACCEPTED: u32 = 12u;
const EDGES: u32 = 20u;
const FOLLOWERS: u32 = 32u;

fn accepts(node: u32, follower: u32) -> bool {
    var lower = 0u;
    for (var i = 0u; i < min(follower_counts[node], FOLLOWERS); i++) {
        lower += select(0u, 1u, followers[FOLLOWERS * node + i] < follower);
    }
    return lower < ACCEPTED;
}

// Keeps `row` ascending and free of doubles; NO_NODE fills its end.
fn add_edge(row: ptr<function, array<u32, EDGES>>, node: u32) {
    var moved = node;
    for (var i = 0u; i < EDGES; i++) {
        let held = (*row)[i];
        if held == moved {
            return;
        }
        if moved < held {
            (*row)[i] = moved;
            moved = held;
        }
    }
}

@compute @workgroup_size(64)
fn join_edges(@builtin(global_invocation_id) id: vec3<u32>) {
    let own = id.x;
    if own >= arrayLength(&nodes) {
        return;
    }
    var row: array<u32, EDGES>;
    for (var i = 0u; i < EDGES; i++) {
        row[i] = NO_NODE;
    }
    if is_node(nodes[own]) {
        for (var i = 0u; i < NEAREST; i++) {
            let near = nearest[NEAREST * own + i];
            if near != NO_NODE && accepts(near, own) {
                add_edge(&row, near);
            }
        }
        for (var i = 0u; i < min(follower_counts[own], FOLLOWERS); i++) {
            let follower = followers[FOLLOWERS * own + i];
            if accepts(own, follower) {
                add_edge(&row, follower);
            }
        }
    }
    for (var i = 0u; i < EDGES; i++) {
        edges[EDGES * own + i] = row[i];
    }
}
