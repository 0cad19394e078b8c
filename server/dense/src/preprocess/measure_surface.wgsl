// From disparity planes to what fusion takes: depth, its standard deviation, normal, colour and grey value.
//
// z = f b / (d - d_inf); sigma_z = z^2 / (f b) sigma_d. A plane d = d0 + a (u - u0) + c (v - v0) in disparity is the
// plane N . X = 1 in space with f b N = (a fx, c fy, d0 - d_inf - a (u0 - cx) - c (v0 - cy)): its normal is exact,
// no differences of depths are taken. Planes that the line of sight
// grazes are no measurement: mostly they join two surfaces that lie behind one another. One invocation per pixel.

struct Triangulation {
    // fx, fy, cx, cy in pixels
    intrinsics: vec4<f32>,
    // fx times baseline, px m
    focal_baseline: f32,
    // disparity of infinitely far points, px
    disparity_at_infinity: f32,
    // px: smaller disparities (beyond that of infinity) are no measurement
    disparity_min: f32,
    width: u32,
    height: u32,
    // words of four pixels per row of `masked`
    words: u32,
    // least cosine of the angle between the normal and the line of sight
    incidence_cos_min: f32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> rig: Triangulation;
@group(0) @binding(1) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> color: array<u32>;
@group(0) @binding(3) var<storage, read> masked: array<u32>;
@group(0) @binding(4) var<storage, read_write> depth: array<f32>;
@group(0) @binding(5) var<storage, read_write> sigma_z: array<f32>;
@group(0) @binding(6) var<storage, read_write> normal: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> tissue_color: array<u32>;
@group(0) @binding(8) var<storage, read> grey: array<f32>;
@group(0) @binding(9) var<storage, read_write> tissue_grey: array<f32>;

@compute @workgroup_size(64)
fn measure_surface(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= rig.width || id.y >= rig.height) {
        return;
    }
    let index = id.y * rig.width + id.x;
    let word = masked[id.y * rig.words + (id.x >> 2u)];
    let covered = ((word >> (8u * (id.x & 3u))) & 255u) != 0u;
    tissue_color[index] = (color[index] & 0x00ffffffu) | select(0xff000000u, 0u, covered);
    tissue_grey[index] = select(grey[index], -1.0, covered);
    let plane = planes[index];
    let disparity = plane.x - rig.disparity_at_infinity;
    let from_centre = vec2<f32>(f32(id.x), f32(id.y)) - rig.intrinsics.zw;
    let away = normalize(vec3<f32>(plane.yz * rig.intrinsics.xy, disparity - dot(plane.yz, from_centre)));
    let incidence = dot(away, normalize(vec3<f32>(from_centre / rig.intrinsics.xy, 1.0)));
    // also refuses NaN
    if (!(disparity >= rig.disparity_min) || !(incidence >= rig.incidence_cos_min) || covered) {
        depth[index] = 0.0;
        sigma_z[index] = 0.0;
        normal[index] = vec4<f32>(0.0);
        return;
    }
    let z = rig.focal_baseline / disparity;
    depth[index] = z;
    sigma_z[index] = z * z / rig.focal_baseline * plane.w;
    normal[index] = vec4<f32>(-away, 1.0);
}
