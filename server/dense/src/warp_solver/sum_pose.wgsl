#import surfel
#import graph
// Partial sums over residuals: matrix (upper triangle, 21) and gradient (6) of the pose, and the energy, with that of the
// nodes. 512 invocations, each with every 512th residual and node.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> state: SolverState;
@group(0) @binding(2) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> edges: array<u32>;
@group(0) @binding(4) var<storage, read> solved: array<u32>;
@group(0) @binding(5) var<storage, read> solve_index: array<u32>;
@group(0) @binding(6) var<storage, read> estimates: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> robust: array<vec2<f32>>;
@group(0) @binding(9) var<storage, read> gradients: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read> in_camera: array<vec4<f32>>;
// 28 per invocation
@group(0) @binding(11) var<storage, read_write> partials: array<f32>;

@compute @workgroup_size(64)
fn sum_pose(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= PARTIALS || state.done != 0u || state.fresh == 0u {
        return;
    }
    var sums: array<f32, 28>;
    for (var residual = id.x; residual < residual_count(settings); residual += PARTIALS) {
        let weight = gradients[residual].w;
        if weight == 0.0 {
            continue;
        }
        let normal = planes[residual].xyz;
        let turn = cross(in_camera[residual].xyz, normal);
        let row = array<f32, 6>(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
        var place = 0u;
        for (var i = 0u; i < 6u; i++) {
            for (var j = i; j < 6u; j++) {
                sums[place] += weight * row[i] * row[j];
                place += 1u;
            }
            sums[21u + i] += weight * row[i] * in_camera[residual].w;
        }
        sums[27] += huber(in_camera[residual].w, robust[residual]).x;
    }
    for (var number = id.x; number < state.solved; number += PARTIALS) {
        sums[27] += node_energy(state.present, solved[number]);
    }
    for (var i = 0u; i < 28u; i++) {
        partials[28u * id.x + i] = sums[i];
    }
}
