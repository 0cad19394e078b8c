#import view
#import finite
#import fusion
#import held_out
// Back-projection error: the model under the tracker's pose against the observed depth, as an integer histogram of
// |model depth - observed depth|, before anything is fused; held-out pixels have their own. Each invocation takes 16
// pixels.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: FusionSettings;
@group(0) @binding(2) var<uniform> index_scale: u32;
@group(0) @binding(3) var<storage, read> depth: array<f32>;
@group(0) @binding(4) var<storage, read> slots: array<u32>;
@group(0) @binding(5) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> results: array<atomic<u32>>;

const PIXELS: u32 = 16u;

// Depth at which a pixel's ray meets the plane of a surfel.
fn model_depth(slot: u32, pixel: vec2<f32>) -> f32 {
    let center = transform_point(view.camera_from_world, geometry[slot].xyz);
    let normal = rotate(view.camera_from_world, orientation[slot].xyz);
    let met = dot(normal, center) / dot(normal, ray(view.intrinsics, pixel));
    // a plane seen edge-on says nothing beyond its disc
    return clamp(met, center.z - geometry[slot].w, center.z + geometry[slot].w);
}

@compute @workgroup_size(64)
fn compare_depth(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixels = view.size.x * view.size.y;
    let start = id.x * PIXELS;
    var measured = 0u;
    for (var pixel = start; pixel < min(start + PIXELS, pixels); pixel++) {
        let observed = depth[pixel];
        if !is_finite(observed) || observed <= 0.0 {
            continue;
        }
        measured += 1u;
        let at = vec2<u32>(pixel % view.size.x, pixel / view.size.x);
        let cell = at * index_scale + index_scale / 2u;
        let stored = slots[cell.y * view.size.x * index_scale + cell.x];
        if stored == 0u {
            continue;
        }
        let error = abs(model_depth(~stored, vec2<f32>(at)) - observed);
        if is_finite(error) {
            let bin = u32(min(error / settings.error_bin_m, f32(ERROR_BINS - 1u)));
            let histogram = select(HISTOGRAM, HELD_OUT_HISTOGRAM, is_held_out(at));
            atomicAdd(&results[histogram + bin], 1u);
        }
    }
    if measured > 0u {
        atomicAdd(&results[MEASURED], measured);
    }
}
