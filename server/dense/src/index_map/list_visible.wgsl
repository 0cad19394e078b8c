#import view
#import finite
#import surfel
// Finds the surfels that lie in a view, before all else looks at surfels: what is out of view then costs nothing more. Each
// invocation takes a chunk of 32 slots and leaves one bit per slot. On the way, unstable surfels that were not seen for too
// long are deleted (step 4 of Algorithm 2); those in view are judged by `settle`.
//
// A chunk of stable surfels keeps a sphere around them, so that it is passed over while that is out of view. Unseen surfels
// move only with their nodes: a margin covers what they move until the sphere is made anew, every 32nd frame.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> splat: SplatSettings;
@group(0) @binding(2) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> history: array<vec4<u32>>;
// bits of a chunk's visible slots, and their number
@group(0) @binding(4) var<storage, read_write> masks: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
// place 2: surfels deleted
@group(0) @binding(6) var<storage, read_write> results: array<atomic<u32>>;

// per chunk: centre in world and radius of the sphere, metres; the radius is above 0 only where it holds
@group(0) @binding(7) var<storage, read_write> spheres: array<vec4<f32>>;

const CHUNK: u32 = 32u;
const DIED: u32 = 2u;
const REFRESH_FRAMES: u32 = 32u;
const MARGIN_M: f32 = 8e-3;

// Whether a sphere in the camera's frame is at least partly in view.
fn is_sphere_in_view(center: vec3<f32>, radius: f32) -> bool {
    let f = view.intrinsics.xy;
    let c = view.intrinsics.zw + 1.0;
    let far = vec2<f32>(view.size) - view.intrinsics.zw;
    let left = (center.xy * f + center.z * c) + radius * sqrt(f * f + c * c);
    let right = (center.z * far - center.xy * f) + radius * sqrt(f * f + far * far);
    return center.z + radius > 0.0 && all(left > vec2<f32>(0.0)) && all(right > vec2<f32>(0.0));
}

fn is_passed_over(chunk: u32) -> bool {
    let sphere = spheres[chunk];
    if !(sphere.w > 0.0) || chunk % REFRESH_FRAMES == splat.tick % REFRESH_FRAMES {
        return false;
    }
    return !is_sphere_in_view(transform_point(view.camera_from_world, sphere.xyz), sphere.w + MARGIN_M);
}

fn is_in_view(surfel: vec4<f32>) -> bool {
    let center = transform_point(view.camera_from_world, surfel.xyz);
    if !all_finite(center) || !is_finite(surfel.w) || center.z < 1e-4 {
        return false;
    }
    let at = project(view.intrinsics, center);
    let reach = 1.0 + surfel.w * view.intrinsics.x / center.z;
    return all(at > vec2<f32>(-reach)) && all(at < vec2<f32>(view.size) - 1.0 + reach);
}

@compute @workgroup_size(64)
fn list_visible(@builtin(global_invocation_id) id: vec3<u32>) {
    let first = id.x * CHUNK;
    if first >= splat.slots {
        return;
    }
    if is_passed_over(id.x) {
        masks[id.x] = 0u;
        counts[id.x] = 0u;
        return;
    }
    var mask = 0u;
    var died = 0u;
    // a chunk that is not full yet has no sphere: more surfels will come
    var is_calm = first + CHUNK <= splat.slots;
    var low = vec3<f32>(1e30);
    var high = vec3<f32>(-1e30);
    for (var slot = first; slot < min(first + CHUNK, splat.slots); slot++) {
        let past = history[slot];
        if !is_alive(past.w) {
            continue;
        }
        if !is_stable(past.w) && past.y < splat.forget_before {
            history[slot].w = 0u;
            died += 1u;
            continue;
        }
        let surfel = geometry[slot];
        is_calm = is_calm && is_stable(past.w) && all_finite(surfel.xyz) && is_finite(surfel.w);
        low = min(low, surfel.xyz - surfel.w);
        high = max(high, surfel.xyz + surfel.w);
        if is_in_view(surfel) {
            mask |= 1u << (slot - first);
        }
    }
    masks[id.x] = mask;
    counts[id.x] = countOneBits(mask);
    // nobody is left in an empty chunk
    let extent = select(vec3<f32>(0.0), high - low, high.x >= low.x);
    let radius = 0.5 * max(length(extent), 1e-6);
    spheres[id.x] = vec4<f32>(high - 0.5 * extent, select(0.0, radius, is_calm));
    if died > 0u {
        atomicAdd(&results[DIED], died);
    }
}
