#import finite
#import surfel
#import graph
// The warp that takes each node along with the world of the frame in which it was last seen: between two corrections their
// mean by time, before the first and after the last these. A node without a date has the newest of those nearest to it.

@group(0) @binding(0) var<storage, read> nodes: array<vec4<u32>>;
// NEAREST slots per node
@group(0) @binding(1) var<storage, read> nearest: array<u32>;
@group(0) @binding(2) var<storage, read> dates: array<u32>;
// how many corrections
@group(0) @binding(3) var<uniform> count: u32;
// two rows each, by ascending frame: quaternion (x, y, z, w); translation (m), bits of the frame
@group(0) @binding(4) var<storage, read> corrections: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> transforms: array<vec4<f32>>;

const NEAREST: u32 = 8u;

fn frame_of(index: u32) -> u32 {
    return bitcast<u32>(corrections[2u * index + 1u].w);
}

fn date_of(slot: u32) -> u32 {
    var date = dates[slot];
    for (var i = 0u; i < NEAREST && dates[slot] == 0u; i++) {
        let other = nearest[NEAREST * slot + i];
        if other != NO_NODE {
            date = max(date, dates[other]);
        }
    }
    return max(date, 1u) - 1u;
}

// The last correction of no later frame; the first where there is none.
fn correction_at(frame: u32) -> u32 {
    var low = 0u;
    var high = count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if frame_of(middle) <= frame {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// How far a correction takes a point.
fn shift_of(index: u32, point: vec3<f32>) -> vec3<f32> {
    let turn = corrections[2u * index];
    let twice = 2.0 * cross(turn.xyz, point);
    return turn.w * twice + cross(turn.xyz, twice) + corrections[2u * index + 1u].xyz;
}

// Row of the rotation by a unit quaternion.
fn rotation_rows(q: vec4<f32>) -> array<vec3<f32>, 3> {
    let d = 2.0 * q.xyz * q.xyz;
    let xy = 2.0 * q.x * q.y;
    let xz = 2.0 * q.x * q.z;
    let yz = 2.0 * q.y * q.z;
    let w = 2.0 * q.w * q.xyz;
    return array<vec3<f32>, 3>(
        vec3<f32>(1.0 - d.y - d.z, xy - w.z, xz + w.y),
        vec3<f32>(xy + w.z, 1.0 - d.x - d.z, yz - w.x),
        vec3<f32>(xz - w.y, yz + w.x, 1.0 - d.x - d.y),
    );
}

@compute @workgroup_size(64)
fn bend_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) || !is_node(nodes[slot]) || !all_finite(node_point(nodes[slot])) {
        return;
    }
    let frame = date_of(slot);
    let first = correction_at(frame);
    let second = min(first + 1u, count - 1u);
    let since = frame_of(first);
    let passed = f32(max(frame, since) - since) / f32(max(frame_of(second) - since, 1u));
    let share = min(passed, 1.0);
    let point = node_point(nodes[slot]);
    let shift = mix(shift_of(first, point), shift_of(second, point), share);
    let near = corrections[2u * first];
    let far = corrections[2u * second];
    let turned = rotation_rows(normalize(mix(near, select(-far, far, dot(near, far) >= 0.0), share)));
    for (var row = 0u; row < 3u; row++) {
        transforms[3u * slot + row] = vec4<f32>(turned[row], shift[row]);
    }
}
