// Energy of a node itself: E_rot, E_reg over its edges in both directions, and rest. A kernel that imports this imports
// `node_terms.wgsl` and declares `edges`, `solve_index` and `settings`.

fn node_energy(half: u32, slot: u32) -> f32 {
    let a = rows_of(half, slot);
    var rotation = 0.0;
    for (var p = 0u; p < 3u; p++) {
        for (var q = p; q < 3u; q++) {
            let residual = rotation_residual(a, p, q);
            rotation += residual * residual;
        }
    }
    var bending = 0.0;
    for (var edge = 0u; edge < EDGES; edge++) {
        let other = edges[EDGES * slot + edge];
        if other == NO_NODE {
            break;
        }
        let outward = edge_residual(half, slot, other);
        bending += dot(outward, outward);
        // a neighbour that is not solved has no invocation that counts its side
        if solve_index[other] == NO_NODE {
            let inward = edge_residual(half, other, slot);
            bending += dot(inward, inward);
        }
    }
    let way = vec3<f32>(a[0].w, a[1].w, a[2].w);
    var turn = 0.0;
    for (var axis = 0u; axis < 3u; axis++) {
        let off = turn_residual(a, axis);
        turn += dot(off, off);
    }
    return settings.w_rot * rotation + settings.w_reg * bending + settings.w_rest * dot(way, way)
        + settings.w_rest_turn * turn;
}
