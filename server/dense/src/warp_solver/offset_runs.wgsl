// Lays the runs of each node's list one behind the other: their counts become offsets, and their sum the node's count.

@group(0) @binding(0) var<storage, read_write> runs: array<u32>;
@group(0) @binding(1) var<storage, read_write> node_counts: array<u32>;

@compute @workgroup_size(64)
fn offset_runs(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&node_counts) {
        return;
    }
    var before = 0u;
    for (var run = RUNS_OF_RESIDUALS * id.x; run < RUNS_OF_RESIDUALS * (id.x + 1u); run++) {
        let count = runs[run];
        runs[run] = before;
        before += count;
    }
    node_counts[id.x] = before;
}
