// The warp of one node: three rows, each a row of A and the same component of t. A kernel that imports this declares
// `nodes: array<vec4<u32>>` and `transforms: array<vec4<f32>>`.

// Where node `slot` takes a point (Eq. TransformationFomulation, the bracket for one node).
fn carried_by(slot: u32, point: vec3<f32>) -> vec3<f32> {
    let center = node_point(nodes[slot]);
    let arm = vec4<f32>(point - center, 1.0);
    let rows = array<vec4<f32>, 3>(transforms[3u * slot], transforms[3u * slot + 1u], transforms[3u * slot + 2u]);
    return center + vec3<f32>(dot(rows[0], arm), dot(rows[1], arm), dot(rows[2], arm));
}

// A^-T n of node `slot`: the cofactors of A over its determinant.
fn turned_by(slot: u32, normal: vec3<f32>) -> vec3<f32> {
    let a = transforms[3u * slot].xyz;
    let b = transforms[3u * slot + 1u].xyz;
    let c = transforms[3u * slot + 2u].xyz;
    let cofactors = mat3x3<f32>(cross(b, c), cross(c, a), cross(a, b));
    return (normal * cofactors) / dot(a, cross(b, c));
}
