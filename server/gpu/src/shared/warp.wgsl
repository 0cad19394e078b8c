// The warp of one node: three rows, each a row of A and the same component of t. A kernel that imports this declares
// `transforms: array<vec4<f32>>`.

struct WarpRows {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

fn rows_of(slot: u32) -> WarpRows {
    return WarpRows(transforms[3u * slot], transforms[3u * slot + 1u], transforms[3u * slot + 2u]);
}

// Where a node at `center` takes a point (Eq. TransformationFomulation, the bracket for one node).
fn carried_by(rows: WarpRows, center: vec3<f32>, point: vec3<f32>) -> vec3<f32> {
    let arm = vec4<f32>(point - center, 1.0);
    return center + vec3<f32>(dot(rows.x, arm), dot(rows.y, arm), dot(rows.z, arm));
}

// A^-T n: the cofactors of A over its determinant.
fn turned_by(rows: WarpRows, normal: vec3<f32>) -> vec3<f32> {
    let a = rows.x.xyz;
    let b = rows.y.xyz;
    let c = rows.z.xyz;
    let cofactors = mat3x3<f32>(cross(b, c), cross(c, a), cross(a, b));
    return (normal * cofactors) / dot(a, cross(b, c));
}
