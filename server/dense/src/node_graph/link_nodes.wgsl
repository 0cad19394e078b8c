#import surfel
#import graph
#import near_nodes
// The 8 nearest other nodes of each node within twice its reach, nearest first, ties by the lower id.
// On a surface a node has far fewer than 32 followers, whatever the order they come in.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> node_heads: array<u32>;
@group(0) @binding(3) var<storage, read> node_next: array<u32>;
@group(0) @binding(4) var<storage, read_write> nearest: array<u32>;
// who counts a node among its nearest: how many, and the first 32 in no order
@group(0) @binding(5) var<storage, read_write> follower_counts: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> followers: array<u32>;

const NEAREST: u32 = 8u;
const FOLLOWERS: u32 = 32u;

// The four nearest, and the next four.
struct Neighbours {
    first: NearNodes,
    second: NearNodes,
}

fn look_into(cell: vec3<i32>, own: u32, near: ptr<function, Neighbours>) {
    let point = node_point(nodes[own]);
    var entry = node_heads[node_bucket(cell, graph.bucket_mask)];
    while entry != 0u {
        let slot = entry - 1u;
        let row = nodes[slot];
        let offset = node_point(row) - point;
        let square = dot(offset, offset);
        let is_near = slot != own && square <= (*near).second.square_m.w;
        if is_near && all(cell_of(node_point(row), graph.cells_per_metre) == cell) {
            var first = (*near).first;
            var second = (*near).second;
            let next = keep_near(&first, NearNode(square, slot, row.w));
            let rest = keep_near(&second, next);
            (*near) = Neighbours(first, second);
        }
        entry = node_next[slot];
    }
}

fn follow(node: u32, follower: u32) {
    if node == NO_NODE {
        return;
    }
    let place = atomicAdd(&follower_counts[node], 1u);
    if place < FOLLOWERS {
        followers[FOLLOWERS * node + place] = follower;
    }
}

@compute @workgroup_size(64)
fn link_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let own = id.x;
    if own >= arrayLength(&nodes) {
        return;
    }
    let none = no_nodes(4.0 * graph.reach_m * graph.reach_m);
    var near = Neighbours(none, none);
    if is_node(nodes[own]) {
        let home = cell_of(node_point(nodes[own]), graph.cells_per_metre);
        for (var around = 0; around < 125; around++) {
            look_into(home + vec3<i32>(around % 5, around / 5 % 5, around / 25) - 2, own, &near);
        }
    }
    for (var i = 0u; i < NEAREST; i++) {
        let slot = select(near.second.slot[i % 4u], near.first.slot[i % 4u], i < 4u);
        nearest[NEAREST * own + i] = slot;
        follow(slot, own);
    }
}
