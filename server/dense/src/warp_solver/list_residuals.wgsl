#import surfel
#import graph
// Puts each residual into the lists of its nodes, and notes which pairs of its nodes no edge joins: bit 4 c + d for
// corners c and d.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> anchors: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> places: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> solve_index: array<u32>;
@group(0) @binding(5) var<storage, read> edges: array<u32>;
@group(0) @binding(6) var<storage, read_write> listed: array<u32>;
@group(0) @binding(7) var<storage, read_write> unjoined: array<u32>;

fn are_joined(a: u32, b: u32) -> bool {
    for (var edge = 0u; edge < EDGES; edge++) {
        if edges[EDGES * a + edge] == b {
            return true;
        }
    }
    return false;
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
    var pairs = 0u;
    for (var c = 0u; c < 4u; c++) {
        if own[c] == NO_NODE {
            continue;
        }
        listed[starts[own[c]] + places[residual][c]] = 4u * residual + c;
        for (var d = c + 1u; d < 4u; d++) {
            if own[d] != NO_NODE && is_solved(own[c]) && is_solved(own[d]) && !are_joined(own[c], own[d]) {
                pairs |= (1u << (4u * c + d)) | (1u << (4u * d + c));
            }
        }
    }
    unjoined[residual] = pairs;
}
