// The length of the step along a direction: r . z over p . q. One workgroup.

@group(0) @binding(0) var<storage, read> curvatures: array<f32>;
@group(0) @binding(1) var<storage, read_write> state: SolverState;

const RUNS: u32 = 64u;

var<workgroup> sums: array<f32, RUNS>;

@compute @workgroup_size(RUNS)
fn reduce_curvature(@builtin(local_invocation_index) run: u32) {
    var sum = 0.0;
    for (var i = run; i < 3u * state.solved; i += RUNS) {
        sum += curvatures[i];
    }
    sums[run] = sum;
    workgroupBarrier();
    if run != 0u || state.done != 0u || state.settled != 0u {
        return;
    }
    var curvature = 0.0;
    for (var i = 0u; i < RUNS; i++) {
        curvature += sums[i];
    }
    // a direction without curvature ends the descent: single precision has no more to give
    let usable = curvature > 0.0 && state.descent > 0.0;
    state.step = select(0.0, state.descent / curvature, usable);
    state.settled = select(1u, 0u, usable);
    for (var i = 0u; i < 6u; i++) {
        state.stepped[i] += state.step * state.along[i];
    }
}
