// Sums of a residual's products for a block of the normal matrix. Written out: with indices that the compiler knows the
// sums stay in registers.

// Adds q_c r for each component c of q.
fn add_product(block: ptr<function, array<vec4<f32>, EDGE>>, first: u32, q: vec4<f32>, r: vec4<f32>) {
    (*block)[first] += q.x * r;
    (*block)[first + 1u] += q.y * r;
    (*block)[first + 2u] += q.z * r;
    (*block)[first + 3u] += q.w * r;
}

// The four rows of a pair of axes.
fn block_of(block: ptr<function, array<vec4<f32>, EDGE>>, first: u32) -> mat4x4<f32> {
    return mat4x4<f32>((*block)[first], (*block)[first + 1u], (*block)[first + 2u], (*block)[first + 3u]);
}

// Adds (a a^T) (x) (q r^T), for the pairs of axes xx xy xz yy yz zz.
fn add_products(block: ptr<function, array<vec4<f32>, EDGE>>, a: vec3<f32>, q: vec4<f32>, r: vec4<f32>) {
    add_product(block, 0u, (a.x * a.x) * q, r);
    add_product(block, 4u, (a.x * a.y) * q, r);
    add_product(block, 8u, (a.x * a.z) * q, r);
    add_product(block, 12u, (a.y * a.y) * q, r);
    add_product(block, 16u, (a.y * a.z) * q, r);
    add_product(block, 20u, (a.z * a.z) * q, r);
}
