#import surfel
#import graph
#import near_nodes
#import binding
// Growth, pass 3, and removal: nodes that no surfel has held for 64 frames go; then the chosen surfels become nodes in
// the lowest free slots, in the order of the table. A new node takes over from its neighbours how far they have
// travelled. One workgroup: each of its invocations has a run of slots and a run of places to itself.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> chosen: array<u32>;
@group(0) @binding(3) var<storage, read> node_heads: array<u32>;
@group(0) @binding(4) var<storage, read> node_next: array<u32>;
@group(0) @binding(5) var<storage, read_write> nodes: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> transforms: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> travelled: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> held: array<u32>;
// nodes alive, next id, refused, added, removed
@group(0) @binding(9) var<storage, read_write> state: array<u32>;
// the free slots, ascending
@group(0) @binding(10) var<storage, read_write> free: array<u32>;

const RUNS: u32 = 256u;
const HELD_TICKS: u32 = 64u;

// per invocation: free slots, chosen surfels, removed nodes
var<workgroup> counts: array<vec3<u32>, RUNS>;

@compute @workgroup_size(RUNS)
fn place_nodes(@builtin(local_invocation_index) run: u32) {
    let slots = arrayLength(&nodes) / RUNS;
    let places = (graph.claim_mask + 1u) / RUNS;
    var own = vec3<u32>(0u);
    for (var slot = run * slots; slot < (run + 1u) * slots; slot++) {
        if is_node(nodes[slot]) && graph.tick - held[slot] > HELD_TICKS {
            nodes[slot].w = 0u;
            own.z += 1u;
        }
        own.x += select(1u, 0u, is_node(nodes[slot]));
    }
    for (var place = run * places; place < (run + 1u) * places; place++) {
        own.y += select(0u, 1u, chosen[place] != 0u);
    }
    counts[run] = own;
    workgroupBarrier();
    var before = vec3<u32>(0u);
    var total = vec3<u32>(0u);
    for (var other = 0u; other < RUNS; other++) {
        before += select(vec3<u32>(0u), counts[other], other < run);
        total += counts[other];
    }
    for (var slot = run * slots; slot < (run + 1u) * slots; slot++) {
        if !is_node(nodes[slot]) {
            free[before.x] = slot;
            before.x += 1u;
        }
    }
    let first_id = state[1];
    storageBarrier();
    let added = min(total.x, total.y);
    for (var place = run * places; place < (run + 1u) * places; place++) {
        if chosen[place] != 0u && before.y < added {
            place_node(free[before.y], geometry[chosen[place] - 1u].xyz, first_id + before.y);
            before.y += 1u;
        }
    }
    if run == 0u {
        state[0] = arrayLength(&nodes) - total.x + added;
        state[1] = first_id + added;
        state[2] = total.y - added;
        state[3] = added;
        state[4] = total.z;
    }
}

fn place_node(slot: u32, point: vec3<f32>, id: u32) {
    let near = bind_to_nodes(point);
    var carried = array<vec4<f32>, 3>(vec4<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0));
    for (var corner = 0u; corner < 4u; corner++) {
        if near.weights[corner] > 0.0 {
            for (var row = 0u; row < 3u; row++) {
                carried[row] += near.weights[corner] * travelled[3u * near.slots[corner] + row];
            }
        }
    }
    nodes[slot] = vec4<u32>(bitcast<vec3<u32>>(point), id + 1u);
    held[slot] = graph.tick;
    for (var row = 0u; row < 3u; row++) {
        var identity = vec4<f32>(0.0);
        identity[row] = 1.0;
        transforms[3u * slot + row] = identity;
        travelled[3u * slot + row] = select(identity, carried[row], near.weights.x > 0.0);
    }
}
