#import surfel
#import graph
// Brings each list into ascending order, so that sums over it have the same bits in every run: an entry's place is the
// number of smaller ones in its list.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> anchors: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> starts: array<u32>;
@group(0) @binding(3) var<storage, read> node_counts: array<u32>;
@group(0) @binding(4) var<storage, read> listed: array<u32>;
@group(0) @binding(5) var<storage, read_write> entries: array<u32>;

@compute @workgroup_size(64)
fn sort_residuals(@builtin(global_invocation_id) id: vec3<u32>) {
    let entry = id.x;
    if entry >= 4u * residual_count(settings) {
        return;
    }
    let slot = anchors[entry / 4u][entry % 4u];
    if slot == NO_NODE {
        return;
    }
    let start = starts[slot];
    var smaller = 0u;
    for (var i = start; i < start + node_counts[slot]; i++) {
        smaller += select(0u, 1u, listed[i] < entry);
    }
    entries[start + smaller] = entry;
}
