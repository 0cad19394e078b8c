// Residuals of a node itself, of E_rot and E_reg. A kernel that imports this imports `estimate.wgsl`.

// Deviation of A from a rotation: c_p . c_q - delta_pq for the columns of A.
fn rotation_residual(a: array<vec4<f32>, 3>, p: u32, q: u32) -> f32 {
    return a[0][p] * a[0][q] + a[1][p] * a[1][q] + a[2][p] * a[2][q] - select(0.0, 1.0, p == q);
}

// Row `axis` of A less that of the identity.
fn turn_residual(a: array<vec4<f32>, 3>, axis: u32) -> vec3<f32> {
    var row = a[axis].xyz;
    row[axis] -= 1.0;
    return row;
}

// A_j (g_k - g_j) + g_j + t_j - (g_k + t_k), millimetres.
fn edge_residual(half: u32, from_slot: u32, to_slot: u32) -> vec3<f32> {
    let across = MM * (node_point(nodes[to_slot]) - node_point(nodes[from_slot]));
    let arm = vec4<f32>(across, 1.0);
    var residual = -across;
    for (var row = 0u; row < 3u; row++) {
        residual[row] += dot(estimate_row(half, from_slot, row), arm) - estimate_row(half, to_slot, row).w;
    }
    return residual;
}

fn rows_of(half: u32, slot: u32) -> array<vec4<f32>, 3> {
    return array<vec4<f32>, 3>(
        estimate_row(half, slot, 0u), estimate_row(half, slot, 1u), estimate_row(half, slot, 2u));
}
