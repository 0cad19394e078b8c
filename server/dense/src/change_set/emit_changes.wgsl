#import color
#import finite
#import surfel
// Packs the changed surfels in slot order (so by id) and takes them over into the published copy, one batch at a time.
// Positions are those of the grid on which they are sent, so the copy holds what viewers decode.
// A record: position, radius | normal, weight | id, colour, frame last seen, kind.

struct Record {
    geometry: vec4<f32>,
    orientation: vec4<f32>,
    rest: vec4<u32>,
}

const ADDED: u32 = 0u;
const UPDATED: u32 = 1u;
const REMOVED: u32 = 2u;

@group(0) @binding(0) var<uniform> settings: PublishSettings;
@group(0) @binding(1) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> appearance: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> history: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> changed: array<u32>;
@group(0) @binding(6) var<storage, read> offsets: array<u32>;
@group(0) @binding(7) var<storage, read_write> held_geometry: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> held_orientation: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> held: array<vec4<u32>>;
@group(0) @binding(10) var<storage, read_write> records: array<Record>;

@compute @workgroup_size(64)
fn emit_changes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= settings.slots || changed[slot] == 0u || offsets[slot] >= settings.batch {
        return;
    }
    let past = history[slot];
    let shown = is_stable(past.w) && is_packable(geometry[slot], orientation[slot].xyz);
    let kind = select(REMOVED, select(ADDED, UPDATED, held[slot].w != 0u), shown);
    let color = pack_rgb(appearance[slot].xyz);
    let place = vec4<f32>(on_grid(geometry[slot].xyz, settings.position_step_m), geometry[slot].w);
    records[offsets[slot]] = Record(place, orientation[slot], vec4<u32>(past.x, color, past.y, kind));
    held_geometry[slot] = place;
    held_orientation[slot] = orientation[slot];
    held[slot] = vec4<u32>(past.x, color, past.y, select(0u, 1u, shown));
}
