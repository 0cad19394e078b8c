#import finite
// Accepts the estimate on trial where its energy is lower, else damps more (Levenberg-Marquardt). One workgroup.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> partials: array<f32>;
@group(0) @binding(2) var<storage, read_write> state: SolverState;

const RUNS: u32 = 32u;
const DAMPING_LEAST: f32 = 1e-7;
const DAMPING_MOST: f32 = 1e7;

var<workgroup> sums: array<f32, RUNS>;

@compute @workgroup_size(RUNS)
fn decide(@builtin(local_invocation_index) run: u32) {
    var sum = 0.0;
    for (var i = run; i < PARTIALS; i += RUNS) {
        sum += partials[i];
    }
    sums[run] = sum;
    workgroupBarrier();
    if run != 0u || state.done != 0u {
        return;
    }
    var energy = pose_energy(1u - state.present, settings);
    for (var i = 0u; i < RUNS; i++) {
        energy += sums[i];
    }
    if is_finite(energy) && energy <= state.energy {
        let decrease = state.energy - energy;
        state.done = select(0u, 1u, decrease < settings.energy_tolerance * state.energy);
        state.present = 1u - state.present;
        state.fresh = 1u;
        state.accepted += 1u;
        state.energy = energy;
        state.damping = max(0.2 * state.damping, DAMPING_LEAST);
    } else {
        state.fresh = 0u;
        state.rejected += 1u;
        state.damping = min(10.0 * state.damping, DAMPING_MOST);
    }
}
