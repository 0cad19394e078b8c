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

// What a cell may seem farther away than it is, by rounding, as a share of the squared distance.
const CELL_ROUNDING = 1e-3;

// Square of the distance from a point to a cell.
fn square_to_cell(point: vec3<f32>, cell: vec3<i32>) -> f32 {
    let low = vec3<f32>(cell) / graph.cells_per_metre;
    let high = vec3<f32>(cell + 1) / graph.cells_per_metre;
    let off = max(max(low - point, point - high), vec3<f32>(0.0));
    return dot(off, off);
}

fn bind_to_nodes(point: vec3<f32>) -> NodeBinding {
    // four that move the point, and the one that bounds their weights
    var near = no_nodes(graph.reach_m * graph.reach_m);
    var outer_square_m = graph.reach_m * graph.reach_m;
    let home = cell_of(point, graph.cells_per_metre);
    for (var turn = 0; turn < 27; turn++) {
        // the cell of the point itself comes first: then most others are too far away
        let around = (turn + 13) % 27;
        let cell = home + vec3<i32>(around % 3, around / 3 % 3, around / 9) - 1;
        if square_to_cell(point, cell) * (1.0 - CELL_ROUNDING) > outer_square_m {
            continue;
        }
        var entry = node_heads[node_bucket(cell, graph.bucket_mask)];
        while entry != 0u {
            let row = nodes[entry - 1u];
            let position = node_point(row);
            let offset = position - point;
            let square = offset.x * offset.x + offset.y * offset.y + offset.z * offset.z;
            if square <= outer_square_m && all(cell_of(position, graph.cells_per_metre) == cell) {
                outer_square_m = min(outer_square_m, keep_near(&near, NearNode(square, entry - 1u, row.w)).square_m);
            }
            entry = node_next[entry - 1u];
        }
    }
    return weigh(near, outer_square_m);
}

fn weigh(near: NearNodes, outer_square_m: f32) -> NodeBinding {
    let outer_m = 1.001 * sqrt(outer_square_m) + 1e-6;
    let raw = select(1.0 - sqrt(near.square_m) / outer_m, vec4<f32>(0.0), near.slot == vec4<u32>(NO_NODE));
    let sum = raw.x + raw.y + raw.z + raw.w;
    return NodeBinding(near.slot, select(vec4<f32>(0.0), raw / sum, sum > 0.0), sqrt(near.square_m.x));
}
