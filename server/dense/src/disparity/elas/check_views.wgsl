// Left-right check: a left pixel keeps its disparity where its partner has nearly the same one.
//
// found: match_prior.wgsl, both views. disparities, spreads: the left view, four pixels an element, NO_DISPARITY where
// refused. One invocation per four pixels.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> search: Search;
@group(0) @binding(2) var<storage, read> found: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> disparities: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> spreads: array<vec4<f32>>;

fn checked(x: u32, y: u32) -> vec2<f32> {
    let refused = vec2<f32>(NO_DISPARITY, 0.0);
    let own = found[pixel_index(0u, x, y)];
    if (!known(own.x)) {
        return refused;
    }
    let partner = i32(round(f32(x) - own.x));
    if (partner < 0 || partner >= i32(band.width)) {
        return refused;
    }
    let other = found[pixel_index(1u, u32(partner), y)].x;
    return select(refused, own, abs(other - own.x) <= search.lr_threshold);
}

@compute @workgroup_size(64)
fn check_views(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    var disparity = vec4<f32>(NO_DISPARITY);
    var spread = vec4<f32>(0.0);
    for (var lane = 0u; lane < 4u; lane++) {
        if (4u * id.x + lane < band.width) {
            let result = checked(4u * id.x + lane, id.y);
            disparity[lane] = result.x;
            spread[lane] = result.y;
        }
    }
    disparities[id.y * band.words + id.x] = disparity;
    spreads[id.y * band.words + id.x] = spread;
}
