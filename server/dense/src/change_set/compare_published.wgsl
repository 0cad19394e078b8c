#import color
#import finite
#import surfel
// Finds the slots in which the model and what viewers hold of it differ by more than the stated bounds, and the largest
// difference in position among those that are left as they are.
// The published copy has three rows: position, radius | normal, weight | id, colour, frame last seen, held.

@group(0) @binding(0) var<uniform> settings: PublishSettings;
@group(0) @binding(1) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> appearance: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> history: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> held_geometry: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> held_orientation: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> held: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> changed: array<u32>;
// bits of a length: those of larger lengths are larger
@group(0) @binding(9) var<storage, read_write> worst: array<atomic<u32>>;

fn differs(slot: u32, moved: vec4<f32>) -> bool {
    let now = orientation[slot];
    let before = held_orientation[slot];
    let turned = !all(now.xyz == before.xyz) && dot(now.xyz, before.xyz) <= settings.normal_cos;
    let recolored = abs(unpack_rgb(pack_rgb(appearance[slot].xyz)) - unpack_rgb(held[slot].y));
    // What lies on the place of the grid that it would be sent to cannot be told better.
    let is_best = all(on_grid(geometry[slot].xyz, settings.position_step_m) == held_geometry[slot].xyz);
    let is_off = !is_best && !(length(moved.xyz) <= settings.position_m);
    return is_off || abs(moved.w) > settings.position_m || turned
        || any(recolored > vec3<f32>(settings.color_levels)) || abs(now.w - before.w) > settings.weight_step;
}

@compute @workgroup_size(64)
fn compare_published(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= settings.slots {
        return;
    }
    let shown = is_stable(history[slot].w) && is_packable(geometry[slot], orientation[slot].xyz);
    let is_held = held[slot].w != 0u;
    let moved = geometry[slot] - held_geometry[slot];
    let is_changed = shown != is_held || (shown && differs(slot, moved));
    changed[slot] = select(0u, 1u, is_changed);
    if shown && !is_changed {
        // Read first: there are few records, and atomics are dear.
        let bits = bitcast<u32>(length(moved.xyz));
        if bits > atomicLoad(&worst[0]) {
            atomicMax(&worst[0], bits);
        }
    }
}
