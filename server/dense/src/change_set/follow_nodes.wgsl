#import finite
#import graph
#import surfel
// Moves the nodes that viewers hold by the encoded warp, in whole steps, then takes the model's nodes over where they
// came or went.

@group(0) @binding(0) var<uniform> settings: PublishSettings;
@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> codes: array<u32>;
@group(0) @binding(3) var<storage, read_write> held: array<vec4<i32>>;
// the same as nodes of the graph: bits of the position in metres, id + 1
@group(0) @binding(4) var<storage, read_write> held_rows: array<vec4<u32>>;

// Positions beyond do not fit 32 bits.
const PLACE_MAX: f32 = 2.0e9;

fn translation(slot: u32) -> vec3<i32> {
    let first = bitcast<i32>(codes[6u * slot]);
    let second = bitcast<i32>(codes[6u * slot + 1u]);
    return vec3<i32>((first << 16u) >> 16u, first >> 16u, (second << 16u) >> 16u);
}

@compute @workgroup_size(64)
fn follow_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) {
        return;
    }
    var place = held[slot];
    if place.w != 0 {
        place = vec4<i32>(place.xyz + translation(slot), place.w);
    }
    if bitcast<u32>(place.w) != nodes[slot].w {
        let steps = round(node_point(nodes[slot]) / settings.node_step_m);
        let fits = all_finite(steps) && all(abs(steps) < vec3<f32>(PLACE_MAX));
        place = select(vec4<i32>(0), vec4<i32>(vec3<i32>(steps), bitcast<i32>(nodes[slot].w)), is_node(nodes[slot]) && fits);
    }
    held[slot] = place;
    let point = vec3<f32>(place.xyz) * settings.node_step_m;
    held_rows[slot] = vec4<u32>(bitcast<vec3<u32>>(point), bitcast<u32>(place.w));
}
