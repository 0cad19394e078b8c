// Finds the nodes that move a point; the rule is written down in dense/src/node_graph/mod.rs. A kernel that imports this
// imports `surfel`, `graph` and `near_nodes` too, and declares
//   graph        GraphSettings
//   nodes        array<vec4<u32>>
//   node_heads   per bucket: slot of its first node plus one, 0 where none
//   node_next    per node: slot of the next one in its bucket plus one, 0 at the end

struct NodeBinding {
    // NO_NODE where there are fewer than four
    slots: vec4<u32>,
    // sum to 1; all 0 where no node is in reach
    weights: vec4<f32>,
    // distance to the nearest one, or the reach
    nearest_m: f32,
}

// four that move the point, and the one that bounds their weights
const NEAREST: u32 = 5u;

fn bind_to_nodes(point: vec3<f32>) -> NodeBinding {
    var near: NearNodes;
    for (var i = 0u; i < NEAREST; i++) {
        near.square_m[i] = graph.reach_m * graph.reach_m;
        near.slot[i] = NO_NODE;
        near.id[i] = 0u;
    }
    let home = cell_of(point, graph.cells_per_metre);
    for (var around = 0; around < 27; around++) {
        let cell = home + vec3<i32>(around % 3, around / 3 % 3, around / 9) - 1;
        var entry = node_heads[node_bucket(cell, graph.bucket_mask)];
        while entry != 0u {
            let row = nodes[entry - 1u];
            let position = node_point(row);
            if all(cell_of(position, graph.cells_per_metre) == cell) {
                let offset = position - point;
                let square = offset.x * offset.x + offset.y * offset.y + offset.z * offset.z;
                if square <= near.square_m[4] {
                    keep_near(&near, square, entry - 1u, row.w);
                }
            }
            entry = node_next[entry - 1u];
        }
    }
    return weigh(near);
}

fn weigh(near: NearNodes) -> NodeBinding {
    let outer_m = 1.001 * sqrt(near.square_m[4]) + 1e-6;
    let slots = vec4<u32>(near.slot[0], near.slot[1], near.slot[2], near.slot[3]);
    let squares = vec4<f32>(near.square_m[0], near.square_m[1], near.square_m[2], near.square_m[3]);
    let raw = select(1.0 - sqrt(squares) / outer_m, vec4<f32>(0.0), slots == vec4<u32>(NO_NODE));
    let sum = raw.x + raw.y + raw.z + raw.w;
    return NodeBinding(slots, select(vec4<f32>(0.0), raw / sum, sum > 0.0), sqrt(near.square_m[0]));
}
