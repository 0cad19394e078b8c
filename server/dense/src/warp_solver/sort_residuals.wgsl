#import surfel
#import graph
// Brings each list into ascending order, so that sums over it have the same bits each time: an entry's place is the
// number of smaller ones in its run, behind the runs before.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> anchors: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> starts: array<u32>;
@group(0) @binding(3) var<storage, read> node_counts: array<u32>;
@group(0) @binding(4) var<storage, read> listed: array<u32>;
@group(0) @binding(5) var<storage, read_write> entries: array<u32>;
// per node and run: where the run begins in the node's list
@group(0) @binding(6) var<storage, read> runs: array<u32>;

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
    let run = run_of(entry / 4u, settings);
    let at = RUNS_OF_RESIDUALS * slot + run;
    let first = starts[slot] + runs[at];
    var end = starts[slot] + node_counts[slot];
    if run + 1u < RUNS_OF_RESIDUALS {
        end = starts[slot] + runs[at + 1u];
    }
    var smaller = 0u;
    for (var i = first; i < end; i++) {
        smaller += select(0u, 1u, listed[i] < entry);
    }
    entries[first + smaller] = entry;
}
