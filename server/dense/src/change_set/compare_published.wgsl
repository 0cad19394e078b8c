#import color
#import surfel
// Finds the slots in which the model and what viewers hold of it differ by more than the stated bounds.
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

fn differs(slot: u32) -> bool {
    let moved = geometry[slot] - held_geometry[slot];
    let now = orientation[slot];
    let before = held_orientation[slot];
    let turned = !all(now.xyz == before.xyz) && dot(now.xyz, before.xyz) <= settings.normal_cos;
    let recolored = abs(unpack_rgb(pack_rgb(appearance[slot].xyz)) - unpack_rgb(held[slot].y));
    return length(moved.xyz) > settings.position_m || abs(moved.w) > settings.position_m || turned
        || any(recolored > vec3<f32>(settings.color_levels)) || abs(now.w - before.w) > settings.weight_step;
}

@compute @workgroup_size(64)
fn compare_published(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= settings.slots {
        return;
    }
    let shown = is_stable(history[slot].w);
    let is_held = held[slot].w != 0u;
    changed[slot] = select(0u, 1u, shown != is_held || (shown && differs(slot)));
}
