#import graph
#import surfel
// The estimate on trial: the present one and the step. The pose's own step follows from that of the nodes:
// -C^-1 (c + B^T step).

@group(0) @binding(0) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> solved: array<u32>;
@group(0) @binding(2) var<storage, read> steps: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> estimates: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> state: SolverState;

// Rotation by a vector.
fn rotation(turn: vec3<f32>) -> mat3x3<f32> {
    let square = dot(turn, turn);
    // sin x / x and (1 - cos x) / x^2 as series: turns within a frame are small
    let first = 1.0 - square / 6.0 * (1.0 - square / 20.0);
    let second = 0.5 - square / 24.0 * (1.0 - square / 30.0);
    let cross_matrix = mat3x3<f32>(
        vec3<f32>(0.0, turn.z, -turn.y), vec3<f32>(-turn.z, 0.0, turn.x), vec3<f32>(turn.y, -turn.x, 0.0));
    let identity = mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    return identity + first * cross_matrix + second * cross_matrix * cross_matrix;
}

fn step_pose() {
    var step: array<f32, 6>;
    for (var i = 0u; i < 6u; i++) {
        for (var j = 0u; j < 6u; j++) {
            step[i] -= state.inverse[6u * i + j] * (state.gradient[j] + state.stepped[j]);
        }
    }
    let turn = rotation(vec3<f32>(step[3], step[4], step[5]));
    let from_row = 3u * state.present;
    let to_row = 3u * (1u - state.present);
    for (var column = 0u; column < 4u; column++) {
        let before = vec3<f32>(state.poses[from_row][column], state.poses[from_row + 1u][column],
            state.poses[from_row + 2u][column]);
        let after = turn * before + select(vec3<f32>(0.0), vec3<f32>(step[0], step[1], step[2]), column == 3u);
        for (var row = 0u; row < 3u; row++) {
            state.poses[to_row + row][column] = after[row];
        }
    }
}

@compute @workgroup_size(64)
fn take_step(@builtin(global_invocation_id) id: vec3<u32>) {
    if state.done != 0u {
        return;
    }
    if id.x < state.solved {
        let slot = solved[id.x];
        let from_half = 3u * (state.present * arrayLength(&nodes) + slot);
        let to_half = 3u * ((1u - state.present) * arrayLength(&nodes) + slot);
        for (var axis = 0u; axis < 3u; axis++) {
            estimates[to_half + axis] = estimates[from_half + axis] + steps[3u * id.x + axis];
        }
    }
    if id.x == 0u {
        step_pose();
    }
}
