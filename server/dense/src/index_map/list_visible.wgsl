#import view
#import finite
#import surfel
// Finds the surfels that lie in a view, before all else looks at surfels: what is out of view then costs nothing more. Each
// invocation takes a chunk of 32 slots and leaves one bit per slot. On the way, unstable surfels that were not seen for too
// long are deleted (step 4 of Algorithm 2); those in view are judged by `settle`.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> splat: SplatSettings;
@group(0) @binding(2) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> history: array<vec4<u32>>;
// bits of a chunk's visible slots, and their number
@group(0) @binding(4) var<storage, read_write> masks: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
// place 2: surfels deleted
@group(0) @binding(6) var<storage, read_write> results: array<atomic<u32>>;

const CHUNK: u32 = 32u;
const DIED: u32 = 2u;

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
    var mask = 0u;
    var died = 0u;
    for (var slot = first; slot < min(first + CHUNK, splat.slots); slot++) {
        let past = history[slot];
        if !is_alive(past.w) {
            continue;
        }
        if !is_stable(past.w) && past.y < splat.forget_before {
            history[slot].w = 0u;
            died += 1u;
        } else if is_in_view(geometry[slot]) {
            mask |= 1u << (slot - first);
        }
    }
    masks[id.x] = mask;
    counts[id.x] = countOneBits(mask);
    if died > 0u {
        atomicAdd(&results[DIED], died);
    }
}
