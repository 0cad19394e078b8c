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

// What E_reg adds to the block of an axis, less its sign.
fn bending(outward: vec4<f32>, inward: vec4<f32>) -> mat4x4<f32> {
    var rows = mat4x4<f32>();
    rows[0].w = settings.w_reg * outward.x;
    rows[1].w = settings.w_reg * outward.y;
    rows[2].w = settings.w_reg * outward.z;
    rows[3] = settings.w_reg * (inward + vec4<f32>(0.0, 0.0, 0.0, outward.w));
    return rows;
}

fn store(first: u32, rows: mat4x4<f32>) {
    blocks[first] = rows[0];
    blocks[first + 1u] = rows[1];
    blocks[first + 2u] = rows[2];
    blocks[first + 3u] = rows[3];
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
    let bent = bending(vec4<f32>(across, 1.0), vec4<f32>(-across, 1.0));
    store(EDGE * id.x, block_of(&block, 0u) - bent);
    store(EDGE * id.x + 4u, block_of(&block, 4u));
    store(EDGE * id.x + 8u, block_of(&block, 8u));
    store(EDGE * id.x + 12u, block_of(&block, 12u) - bent);
    store(EDGE * id.x + 16u, block_of(&block, 16u));
    store(EDGE * id.x + 20u, block_of(&block, 20u) - bent);
}
