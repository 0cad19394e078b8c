#import surfel
#import graph
// A node's own 12 x 12 block: for each axis and component of q, three vectors of four. Data, E_reg of all its edges, E_rot
// (Gauss-Newton) and rest. Where a residual's nodes j and k are not joined by an edge, their mixed term is bounded by
// w_j w_k (c_j^2 + c_k^2) and so added here: the matrix stays positive, the gradient is exact, and the solution the same.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> state: SolverState;
@group(0) @binding(2) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> edges: array<u32>;
@group(0) @binding(4) var<storage, read> solved: array<u32>;
@group(0) @binding(5) var<storage, read> starts: array<u32>;
@group(0) @binding(6) var<storage, read> node_counts: array<u32>;
@group(0) @binding(7) var<storage, read> entries: array<u32>;
@group(0) @binding(8) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> unjoined: array<u32>;
@group(0) @binding(10) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read> gradients: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read> estimates: array<vec4<f32>>;
@group(0) @binding(13) var<storage, read_write> own_blocks: array<vec4<f32>>;

// The weight of a residual's square in the block of its corner: w_c^2, and w_c w_d for corners d that no edge joins.
fn own_weight(residual: u32, corner: u32) -> f32 {
    let w = weights[residual];
    let bits = (unjoined[residual] >> (4u * corner)) & 15u;
    let apart = select(vec4<f32>(0.0), w, (vec4<u32>(bits) & vec4<u32>(1u, 2u, 4u, 8u)) != vec4<u32>(0u));
    return w[corner] * (w[corner] + apart.x + apart.y + apart.z + apart.w);
}

// Sum over edges of [d; 1] [d; 1]^T + e_4 e_4^T.
fn bending_rows(slot: u32) -> mat4x4<f32> {
    var rows = mat4x4<f32>();
    for (var edge = 0u; edge < EDGES; edge++) {
        let other = edges[EDGES * slot + edge];
        if other == NO_NODE {
            break;
        }
        let arm = vec4<f32>(MM * (node_point(nodes[other]) - node_point(nodes[slot])), 1.0);
        rows += mat4x4<f32>(arm.x * arm, arm.y * arm, arm.z * arm, arm);
        rows[3].w += 1.0;
    }
    return rows;
}

// Row of the Gauss-Newton matrix of E_rot: element (axis, column) against the columns of `other_axis`; none for `t`.
fn rotation_row(a: array<vec4<f32>, 3>, axis: u32, column: u32, other_axis: u32) -> vec4<f32> {
    var row = vec4<f32>(0.0);
    for (var q = 0u; q < 3u; q++) {
        // residual of the columns (column, q): its derivative by (axis, column) is a[axis][q], twice that where q = column
        let own = a[axis][q] * select(1.0, 2.0, q == column);
        row[column] += own * a[other_axis][q];
        row[q] += own * a[other_axis][column];
    }
    return row;
}

// Writes what two axes have with each other, and adds E_rot.
fn store(number: u32, pair: vec2<u32>, block: mat4x4<f32>, a: array<vec4<f32>, 3>) {
    let first = OWN * number + 12u * pair.x + pair.y;
    own_blocks[first] = block[0] + settings.w_rot * rotation_row(a, pair.x, 0u, pair.y);
    own_blocks[first + 3u] = block[1] + settings.w_rot * rotation_row(a, pair.x, 1u, pair.y);
    own_blocks[first + 6u] = block[2] + settings.w_rot * rotation_row(a, pair.x, 2u, pair.y);
    own_blocks[first + 9u] = block[3];
}

@compute @workgroup_size(64)
fn assemble_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x;
    if number >= state.solved || state.done != 0u || state.fresh == 0u {
        return;
    }
    let slot = solved[number];
    let center = node_point(nodes[slot]);
    var data: array<vec4<f32>, EDGE>;
    for (var i = starts[slot]; i < starts[slot] + node_counts[slot]; i++) {
        let residual = entries[i] / 4u;
        let scale = own_weight(residual, entries[i] % 4u) * gradients[residual].w;
        let a = gradients[residual].xyz;
        let q = vec4<f32>(MM * (points[residual].xyz - center), 1.0);
        add_products(&data, a, q, scale * q);
    }
    let half = 3u * (state.present * arrayLength(&nodes) + slot);
    let rows = array<vec4<f32>, 3>(estimates[half], estimates[half + 1u], estimates[half + 2u]);
    var own = settings.w_reg * bending_rows(slot);
    own[0].x += settings.w_rest_turn;
    own[1].y += settings.w_rest_turn;
    own[2].z += settings.w_rest_turn;
    own[3].w += settings.w_rest;
    let xy = block_of(&data, 4u);
    let xz = block_of(&data, 8u);
    let yz = block_of(&data, 16u);
    store(number, vec2<u32>(0u, 0u), block_of(&data, 0u) + own, rows);
    store(number, vec2<u32>(0u, 1u), xy, rows);
    store(number, vec2<u32>(0u, 2u), xz, rows);
    store(number, vec2<u32>(1u, 0u), xy, rows);
    store(number, vec2<u32>(1u, 1u), block_of(&data, 12u) + own, rows);
    store(number, vec2<u32>(1u, 2u), yz, rows);
    store(number, vec2<u32>(2u, 0u), xz, rows);
    store(number, vec2<u32>(2u, 1u), yz, rows);
    store(number, vec2<u32>(2u, 2u), block_of(&data, 20u) + own, rows);
}
