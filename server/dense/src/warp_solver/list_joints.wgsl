#import surfel
#import graph
// Of each solved node's list, which residuals it shares with the node at the other end of each of its edges: their entries
// in the same order, with the corner there, as 4 entry + corner. One invocation per solved node.

@group(0) @binding(0) var<storage, read> state: SolverState;
@group(0) @binding(1) var<storage, read> solved: array<u32>;
@group(0) @binding(2) var<storage, read> starts: array<u32>;
@group(0) @binding(3) var<storage, read> node_counts: array<u32>;
@group(0) @binding(4) var<storage, read> entries: array<u32>;
// per residual and corner c: five bits for each corner d, the edge of c that leads there
@group(0) @binding(5) var<storage, read> joints: array<u32>;
// per edge: where its list ends; it begins where that of the edge before ends, a node's first at three times its start
@group(0) @binding(6) var<storage, read_write> shared_ends: array<u32>;
@group(0) @binding(7) var<storage, read_write> shared_entries: array<u32>;

// Edge that leads from an entry's corner to corner `d`.
fn edge_to(entry: u32, d: u32) -> u32 {
    return (joints[entry] >> (5u * d)) & 31u;
}

@compute @workgroup_size(64)
fn list_joints(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= state.solved {
        return;
    }
    let slot = solved[id.x];
    let first = starts[slot];
    let end = first + node_counts[slot];
    var cursors: array<u32, EDGES>;
    for (var i = first; i < end; i++) {
        for (var d = 0u; d < 4u; d++) {
            let edge = edge_to(entries[i], d);
            if edge < EDGES {
                cursors[edge]++;
            }
        }
    }
    var before = 3u * first;
    for (var edge = 0u; edge < EDGES; edge++) {
        let count = cursors[edge];
        cursors[edge] = before;
        before += count;
        shared_ends[EDGES * id.x + edge] = before;
    }
    for (var i = first; i < end; i++) {
        for (var d = 0u; d < 4u; d++) {
            let edge = edge_to(entries[i], d);
            if edge < EDGES {
                shared_entries[cursors[edge]] = 4u * entries[i] + d;
                cursors[edge]++;
            }
        }
    }
}
