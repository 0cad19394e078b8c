// Applying an estimate. A kernel that imports this imports `estimate.wgsl` and declares `anchors`, `weights`, `points`.

// Where an estimate takes the point of a residual, metres in world.
fn warped(residual: u32, half: u32) -> vec3<f32> {
    let point = points[residual].xyz;
    var moved = vec3<f32>(0.0);
    for (var corner = 0u; corner < 4u; corner++) {
        let slot = anchors[residual][corner];
        if slot != NO_NODE {
            let center = node_point(nodes[slot]);
            let arm = vec4<f32>(point - center, 1.0 / MM);
            let offset = vec3<f32>(dot(estimate_row(half, slot, 0u), arm), dot(estimate_row(half, slot, 1u), arm),
                dot(estimate_row(half, slot, 2u), arm));
            moved += weights[residual][corner] * (center + offset);
        }
    }
    return moved;
}
