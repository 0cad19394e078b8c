#import surfel
#import graph
// Puts each residual into the lists of its nodes, and notes which edges join them. Which pairs no edge joins: bit
// 4 c + d for corners c and d.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> anchors: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> places: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> solve_index: array<u32>;
@group(0) @binding(5) var<storage, read> edges: array<u32>;
@group(0) @binding(6) var<storage, read_write> listed: array<u32>;
@group(0) @binding(7) var<storage, read_write> unjoined: array<u32>;
// per node and run: where the run begins in the node's list
@group(0) @binding(8) var<storage, read> runs: array<u32>;
// per residual and corner c: five bits for each corner d, the edge of c that leads there
@group(0) @binding(9) var<storage, read_write> joints: array<u32>;

fn edge_between(a: u32, b: u32) -> u32 {
    for (var edge = 0u; edge < EDGES; edge++) {
        if edges[EDGES * a + edge] == b {
            return edge;
        }
    }
    return NO_EDGE;
}

fn is_solved(slot: u32) -> bool {
    return solve_index[slot] != NO_NODE;
}

@compute @workgroup_size(64)
fn list_residuals(@builtin(global_invocation_id) id: vec3<u32>) {
    let residual = id.x;
    if residual >= residual_count(settings) {
        return;
    }
    let own = anchors[residual];
    let run = run_of(residual, settings);
    var pairs = 0u;
    for (var c = 0u; c < 4u; c++) {
        if own[c] == NO_NODE {
            continue;
        }
        let first = starts[own[c]] + runs[RUNS_OF_RESIDUALS * own[c] + run];
        listed[first + places[residual][c]] = 4u * residual + c;
        var joint = 0u;
        for (var d = 0u; d < 4u; d++) {
            var edge = NO_EDGE;
            if d != c && own[d] != NO_NODE && is_solved(own[c]) && is_solved(own[d]) {
                edge = edge_between(own[c], own[d]);
                pairs |= select(0u, 1u << (4u * c + d), edge == NO_EDGE);
            }
            joint |= edge << (5u * d);
        }
        joints[4u * residual + c] = joint;
    }
    unjoined[residual] = pairs;
}
