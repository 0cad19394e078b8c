#import surfel
#import graph
// Numbers the solved nodes, first those that a residual touches, in the order of their slots; lays their lists of residuals one behind the other, and resets
// the state. One workgroup: each of its invocations has a run of slots to itself.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> marks: array<u32>;
@group(0) @binding(2) var<storage, read> node_counts: array<u32>;
@group(0) @binding(3) var<storage, read_write> solved: array<u32>;
@group(0) @binding(4) var<storage, read_write> solve_index: array<u32>;
@group(0) @binding(5) var<storage, read_write> starts: array<u32>;
@group(0) @binding(6) var<storage, read_write> state: SolverState;

const RUNS: u32 = 256u;

// per invocation: observed nodes, marked ones that are not, residuals
var<workgroup> sums: array<vec3<u32>, RUNS>;

// What one slot adds to these.
fn share_of(slot: u32) -> vec3<u32> {
    let observed = node_counts[slot] > 0u;
    let marked = marks[slot] != 0u;
    return vec3<u32>(select(0u, 1u, observed && marked), select(0u, 1u, marked && !observed), node_counts[slot]);
}

@compute @workgroup_size(RUNS)
fn plan_solve(@builtin(local_invocation_index) run: u32) {
    let slots = arrayLength(&marks) / RUNS;
    var own = vec3<u32>(0u);
    for (var slot = run * slots; slot < (run + 1u) * slots; slot++) {
        own += share_of(slot);
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
        let share = share_of(slot);
        let number = select(total.x + before.y, before.x, share.x != 0u);
        let chosen = share.x + share.y != 0u && number < settings.room;
        solve_index[slot] = select(NO_NODE, number, chosen);
        starts[slot] = before.z;
        if chosen {
            solved[number] = slot;
        }
        before += share;
    }
    if run == 0u {
        reset_state(min(total.x + total.y, settings.room), total.x);
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
