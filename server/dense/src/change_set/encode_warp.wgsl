#import finite
#import graph
#import surfel
// Encodes the motion of every node that viewers hold since they were last told: from the place that they hold to the
// model's, so that rounding never adds up, and the composed A. The warp that comes of decoding it goes to `transforms`.
// Per node, `codes` has six words of two i16: t, then A - I by rows.

@group(0) @binding(0) var<uniform> settings: PublishSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
// x, y, z in steps, id + 1
@group(0) @binding(2) var<storage, read> held: array<vec4<i32>>;
@group(0) @binding(3) var<storage, read_write> travelled: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> codes: array<u32>;
@group(0) @binding(5) var<storage, read_write> transforms: array<vec4<f32>>;

const CODE_MAX: f32 = 32767.0;

fn encode(values: vec3<f32>, step: f32) -> vec3<f32> {
    return clamp(round(values / step), vec3<f32>(-CODE_MAX), vec3<f32>(CODE_MAX));
}

fn word(low: f32, high: f32) -> u32 {
    return (bitcast<u32>(i32(low)) & 0xffffu) | (bitcast<u32>(i32(high)) << 16u);
}

// A row of the identity.
fn unit(row: u32) -> vec3<f32> {
    return select(vec3<f32>(0.0), vec3<f32>(1.0), vec3<u32>(row) == vec3<u32>(0u, 1u, 2u));
}

fn write_row(slot: u32, row: u32, t: f32, a: vec3<f32>) {
    let decoded = unit(row) + a * settings.affine_step;
    transforms[3u * slot + row] = vec4<f32>(decoded, t * settings.node_step_m);
}

fn write_codes(slot: u32, t: vec3<f32>, a0: vec3<f32>, a1: vec3<f32>, a2: vec3<f32>) {
    codes[6u * slot] = word(t.x, t.y);
    codes[6u * slot + 1u] = word(t.z, a0.x);
    codes[6u * slot + 2u] = word(a0.y, a0.z);
    codes[6u * slot + 3u] = word(a1.x, a1.y);
    codes[6u * slot + 4u] = word(a1.z, a2.x);
    codes[6u * slot + 5u] = word(a2.y, a2.z);
    write_row(slot, 0u, t.x, a0);
    write_row(slot, 1u, t.y, a1);
    write_row(slot, 2u, t.z, a2);
}

// A row of A - I; one that is not finite is as if nothing had turned.
fn travelled_row(slot: u32, row: u32) -> vec3<f32> {
    let offset = travelled[3u * slot + row].xyz - unit(row);
    return select(vec3<f32>(0.0), offset, all_finite(offset));
}

fn reset_travelled(slot: u32) {
    for (var row = 0u; row < 3u; row++) {
        travelled[3u * slot + row] = vec4<f32>(unit(row), 0.0);
    }
}

@compute @workgroup_size(64)
fn encode_warp(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) {
        return;
    }
    let none = vec3<f32>(0.0);
    let point = node_point(nodes[slot]);
    let is_same = is_node(nodes[slot]) && bitcast<u32>(held[slot].w) == nodes[slot].w && all_finite(point);
    if !is_same {
        write_codes(slot, none, none, none, none);
        reset_travelled(slot);
        return;
    }
    let moved = point - vec3<f32>(held[slot].xyz) * settings.node_step_m;
    let a0 = travelled_row(slot, 0u);
    let a1 = travelled_row(slot, 1u);
    let a2 = travelled_row(slot, 2u);
    let turned_m = settings.reach_m * sqrt(dot(a0, a0) + dot(a1, a1) + dot(a2, a2));
    if length(moved) + turned_m <= settings.settled_m {
        // What it has travelled adds up until it is worth telling.
        write_codes(slot, none, none, none, none);
        return;
    }
    let step = settings.affine_step;
    write_codes(slot, encode(moved, settings.node_step_m), encode(a0, step), encode(a1, step), encode(a2, step));
    reset_travelled(slot);
}
