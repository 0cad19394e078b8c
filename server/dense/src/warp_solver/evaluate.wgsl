#import view
#import surfel
#import graph
// Energy of the estimate on trial, with the associations of the present one: 512 partial sums.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: SolverSettings;
@group(0) @binding(2) var<storage, read> state: SolverState;
@group(0) @binding(3) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> edges: array<u32>;
@group(0) @binding(5) var<storage, read> solved: array<u32>;
@group(0) @binding(6) var<storage, read> solve_index: array<u32>;
@group(0) @binding(7) var<storage, read> estimates: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> anchors: array<vec4<u32>>;
@group(0) @binding(9) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read> robust: array<vec2<f32>>;
@group(0) @binding(13) var<storage, read> gradients: array<vec4<f32>>;
@group(0) @binding(14) var<storage, read_write> partials: array<f32>;

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= PARTIALS || state.done != 0u {
        return;
    }
    let trial = 1u - state.present;
    var energy = 0.0;
    for (var residual = id.x; residual < residual_count(settings); residual += PARTIALS) {
        if gradients[residual].w != 0.0 {
            let point = corrected(trial, MM * transform_point(view.camera_from_world, warped(residual, trial)));
            energy += huber(dot(planes[residual].xyz, point) - planes[residual].w, robust[residual]).x;
        }
    }
    for (var number = id.x; number < state.solved; number += PARTIALS) {
        energy += node_energy(trial, solved[number]);
    }
    partials[id.x] = energy;
}
