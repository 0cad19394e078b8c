// Adds r . z and B^T z over the nodes; from them come the share of the last direction in the next one, what the border
// makes of that direction, and whether the system is solved. One workgroup.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> partials: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> state: SolverState;

const RUNS: u32 = 64u;

var<workgroup> firsts: array<vec4<f32>, RUNS>;
var<workgroup> seconds: array<vec4<f32>, RUNS>;

@compute @workgroup_size(RUNS)
fn reduce_descent(@builtin(local_invocation_index) run: u32) {
    var first = vec4<f32>(0.0);
    var second = vec4<f32>(0.0);
    for (var number = run; number < state.solved; number += RUNS) {
        first += partials[2u * number];
        second += partials[2u * number + 1u];
    }
    firsts[run] = first;
    seconds[run] = second;
    workgroupBarrier();
    if run != 0u || state.done != 0u || state.settled != 0u {
        return;
    }
    for (var other = 1u; other < RUNS; other++) {
        first += firsts[other];
        second += seconds[other];
    }
    turn_to(first.x, array<f32, 6>(first.y, first.z, first.w, second.x, second.y, second.z));
}

fn turn_to(descent: f32, columns: array<f32, 6>) {
    if state.started == 0u {
        state.first_descent = descent;
        state.carry = 0.0;
        state.started = 1u;
    } else {
        state.carry = descent / state.descent;
    }
    state.descent = descent;
    let tolerance = settings.residual_tolerance * settings.residual_tolerance;
    if !(descent > tolerance * state.first_descent) {
        state.settled = 1u;
    }
    for (var i = 0u; i < 6u; i++) {
        state.along[i] = columns[i] + state.carry * state.along[i];
    }
    for (var i = 0u; i < 6u; i++) {
        var pulled = 0.0;
        for (var j = 0u; j < 6u; j++) {
            pulled += state.inverse[6u * i + j] * state.along[j];
        }
        state.pulled[i] = pulled;
    }
}
