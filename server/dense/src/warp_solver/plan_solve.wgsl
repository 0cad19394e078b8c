#import surfel
#import graph
// Numbers the solved nodes in the order of their slots, lays their lists of residuals one behind the other, and resets
// the state. One workgroup: each of its invocations has a run of slots to itself.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> marks: array<u32>;
@group(0) @binding(2) var<storage, read> node_counts: array<u32>;
@group(0) @binding(3) var<storage, read_write> solved: array<u32>;
@group(0) @binding(4) var<storage, read_write> solve_index: array<u32>;
@group(0) @binding(5) var<storage, read_write> starts: array<u32>;
@group(0) @binding(6) var<storage, read_write> state: SolverState;

const RUNS: u32 = 256u;

// per invocation: marked nodes, residuals, observed nodes
var<workgroup> sums: array<vec3<u32>, RUNS>;

@compute @workgroup_size(RUNS)
fn plan_solve(@builtin(local_invocation_index) run: u32) {
    let slots = arrayLength(&marks) / RUNS;
    var own = vec3<u32>(0u);
    for (var slot = run * slots; slot < (run + 1u) * slots; slot++) {
        own += vec3<u32>(marks[slot], node_counts[slot], min(node_counts[slot], 1u));
    }
    sums[run] = own;
    workgroupBarrier();
    var before = vec3<u32>(0u);
    var total = vec3<u32>(0u);
    for (var other = 0u; other < RUNS; other++) {
        before += select(vec3<u32>(0u), sums[other], other < run);
        total += sums[other];
    }
    for (var slot = run * slots; slot < (run + 1u) * slots; slot++) {
        let chosen = marks[slot] != 0u && before.x < settings.room;
        solve_index[slot] = select(NO_NODE, before.x, chosen);
        starts[slot] = before.y;
        if chosen {
            solved[before.x] = slot;
        }
        before += vec3<u32>(marks[slot], node_counts[slot], 0u);
    }
    if run == 0u {
        reset_state(min(total.x, settings.room), total.z);
    }
}

fn reset_state(solved_count: u32, observed: u32) {
    state.present = 0u;
    state.fresh = 1u;
    state.done = select(0u, 1u, observed == 0u);
    state.settled = 0u;
    state.solved = solved_count;
    state.observed = observed;
    state.accepted = 0u;
    state.rejected = 0u;
    state.damping = settings.damping;
    state.energy = 0.0;
    state.first_energy = 0.0;
    for (var row = 0u; row < 6u; row++) {
        var identity = vec4<f32>(0.0);
        identity[row % 3u] = 1.0;
        state.poses[row] = identity;
    }
}
