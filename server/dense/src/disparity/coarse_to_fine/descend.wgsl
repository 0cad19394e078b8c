// Planes of one level as those of the next finer one: each fine pixel takes the plane of the coarse pixel that it lies
// in, continued to where it lies. Nothing is interpolated, so that edges stay edges.
//
// coarse, fine: disparity, slopes along x and y (px per px, the same at all levels), standard deviation per pixel,
// unpadded rows. One invocation per fine pixel.

struct Descent {
    coarse_width: u32,
    coarse_height: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> descent: Descent;
@group(0) @binding(2) var<storage, read> coarse: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> fine: array<vec4<f32>>;

@compute @workgroup_size(64)
fn descend(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let at = id.xy >> vec2<u32>(1u);
    let plane = coarse[min(at.y, descent.coarse_height - 1u) * descent.coarse_width + at.x];
    // fine pixels lie a quarter of a coarse one to either side of its centre
    let offset = 0.5 * vec2<f32>(id.xy & vec2<u32>(1u)) - 0.25;
    let value = 2.0 * (plane.x + dot(plane.yz, offset));
    let nothing = vec4<f32>(NO_DISPARITY, 0.0, 0.0, 0.0);
    fine[id.y * band.width + id.x] = select(nothing, vec4<f32>(value, plane.yz, 2.0 * plane.w), known(plane.x));
}
