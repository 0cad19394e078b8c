#import surfel
#import graph
// Which nodes are solved: those that a residual touches, and those within two edges of them, so that what is seen bends
// softly into what is not. All others stay where they are. Sets both estimates to rest.

@group(0) @binding(0) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> edges: array<u32>;
@group(0) @binding(2) var<storage, read> node_counts: array<u32>;
@group(0) @binding(3) var<storage, read_write> marks: array<u32>;
@group(0) @binding(4) var<storage, read_write> estimates: array<vec4<f32>>;

fn near_observed(slot: u32) -> bool {
    for (var first = 0u; first < EDGES; first++) {
        let other = edges[EDGES * slot + first];
        if other == NO_NODE {
            return false;
        }
        if node_counts[other] > 0u {
            return true;
        }
        for (var second = 0u; second < EDGES; second++) {
            let farther = edges[EDGES * other + second];
            if farther == NO_NODE {
                break;
            }
            if node_counts[farther] > 0u {
                return true;
            }
        }
    }
    return false;
}

@compute @workgroup_size(64)
fn mark_solved(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= arrayLength(&nodes) {
        return;
    }
    let present = is_node(nodes[slot]);
    marks[slot] = select(0u, 1u, present && (node_counts[slot] > 0u || near_observed(slot)));
    for (var row = 0u; row < 3u; row++) {
        var identity = vec4<f32>(0.0);
        identity[row] = 1.0;
        estimates[3u * slot + row] = identity;
        estimates[3u * (arrayLength(&nodes) + slot) + row] = identity;
    }
}
