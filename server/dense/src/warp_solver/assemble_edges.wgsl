#import surfel
#import graph
// Blocks of the normal matrix between two nodes that an edge joins, one invocation per direction of an edge. The data part
// is a sum of (a a^T) (x) (q_j q_k^T) with q = [v - g; 1], so a block is kept as 6 x 4 vectors: for each pair of axes
// (xx xy xz yy yz zz) and each component of q_j, the four of q_k. E_reg adds its I (x) [d; 1] e_4^T.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> state: SolverState;
@group(0) @binding(2) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> edges: array<u32>;
@group(0) @binding(4) var<storage, read> solved: array<u32>;
@group(0) @binding(5) var<storage, read> solve_index: array<u32>;
@group(0) @binding(6) var<storage, read> starts: array<u32>;
// see list_joints.wgsl
@group(0) @binding(7) var<storage, read> shared_ends: array<u32>;
@group(0) @binding(8) var<storage, read> shared_entries: array<u32>;
@group(0) @binding(9) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read> gradients: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read_write> blocks: array<vec4<f32>>;

fn arm_mm(point: vec3<f32>, slot: u32) -> vec4<f32> {
    return vec4<f32>(MM * (point - node_point(nodes[slot])), 1.0);
}

// Where the list of an edge begins.
fn shared_start(index: u32, slot: u32) -> u32 {
    if index % EDGES == 0u {
        return 3u * starts[slot];
    }
    return shared_ends[index - 1u];
}

@compute @workgroup_size(64)
fn assemble_edges(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x / EDGES;
    if number >= state.solved || state.done != 0u || state.fresh == 0u {
        return;
    }
    let slot = solved[number];
    let other = edges[EDGES * slot + id.x % EDGES];
    if other == NO_NODE || solve_index[other] == NO_NODE {
        return;
    }
    var block: array<vec4<f32>, EDGE>;
    for (var i = shared_start(id.x, slot); i < shared_ends[id.x]; i++) {
        let entry = shared_entries[i] / 4u;
        let residual = entry / 4u;
        let shared_weight = weights[residual][entry % 4u] * weights[residual][shared_entries[i] % 4u];
        let scale = shared_weight * gradients[residual].w;
        if scale == 0.0 {
            continue;
        }
        let a = gradients[residual].xyz;
        let q = arm_mm(points[residual].xyz, slot);
        let outer = scale * arm_mm(points[residual].xyz, other);
        add_products(&block, a, q, outer);
    }
    let across = MM * (node_point(nodes[other]) - node_point(nodes[slot]));
    let outward = vec4<f32>(across, 1.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let first = 4u * axes(axis, axis);
        for (var c = 0u; c < 4u; c++) {
            block[first + c].w -= settings.w_reg * outward[c];
        }
        block[first + 3u] -= settings.w_reg * vec4<f32>(-across, 1.0);
    }
    for (var i = 0u; i < EDGE; i++) {
        blocks[EDGE * id.x + i] = block[i];
    }
}
