#import view
#import finite
#import surfel
#import fusion
// Group 2 of Algorithm 2: each measured pixel that no registered surfel covers claims its cell of the point grid; the
// best measured pixel wins, surfels beat all pixels.
// A pixel's key: 0 | 8 bits of inverted spread | 23 bits of inverted pixel, never 0.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: FusionSettings;
@group(0) @binding(2) var<storage, read> depth: array<f32>;
@group(0) @binding(3) var<storage, read> sigma_z: array<f32>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> results: array<u32>;
@group(0) @binding(6) var<storage, read> covered: array<u32>;
@group(0) @binding(7) var<storage, read_write> claims: array<atomic<u32>>;

@compute @workgroup_size(64)
fn claim_pixels(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.x;
    if pixel >= view.size.x * view.size.y || results[ACCEPTED] == 0u {
        return;
    }
    let measured = depth[pixel];
    let sigma = sigma_z[pixel];
    let normal = normals[pixel];
    if !(is_finite(measured) && is_finite(sigma) && all_finite(normal.xyz)) {
        return;
    }
    let is_covered = (covered[pixel / 32u] & (1u << (pixel % 32u))) != 0u;
    if measured <= 0.0 || sigma <= 0.0 || normal.w == 0.0 || is_covered {
        return;
    }
    let at = vec2<f32>(f32(pixel % view.size.x), f32(pixel / view.size.x));
    let point = transform_point(view.world_from_camera, ray(view.intrinsics, at) * measured);
    let place = cell_hash(cell_of(point, 1.0 / settings.spacing_m), settings.seed) & settings.table_mask;
    let spread = u32(clamp(relative_spread(sigma, measured, settings) * 64.0, 0.0, 255.0));
    atomicMax(&claims[place], ((255u - spread) << 23u) | (0x7fffffu - pixel));
}
