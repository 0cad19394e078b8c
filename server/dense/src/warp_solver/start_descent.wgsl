// Factors each node's damped 12 x 12 block (Cholesky) and starts conjugate gradients at a step of zero: the residual is
// the negative gradient of the Schur complement, b - B C^-1 c, and z its quotient by the factors.

@group(0) @binding(0) var<storage, read> state: SolverState;
@group(0) @binding(1) var<storage, read> own_blocks: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> border: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> factors: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> steps: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> remainders: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> quotients: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> directions: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> partials: array<vec4<f32>>;

fn factor_block(number: u32) {
    var lower: array<f32, 144>;
    for (var row = 0u; row < 12u; row++) {
        for (var column = 0u; column <= row; column++) {
            var value = own_blocks[OWN * number + 3u * row + column / 4u][column % 4u];
            value *= select(1.0, 1.0 + state.damping, row == column);
            for (var k = 0u; k < column; k++) {
                value -= lower[12u * row + k] * lower[12u * column + k];
            }
            lower[12u * row + column] =
                select(value / max(lower[13u * column], 1e-20), sqrt(max(value, 1e-12)), row == column);
        }
    }
    for (var i = 0u; i < OWN; i++) {
        factors[OWN * number + i] =
            vec4<f32>(lower[4u * i], lower[4u * i + 1u], lower[4u * i + 2u], lower[4u * i + 3u]);
    }
}

@compute @workgroup_size(64)
fn start_descent(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x;
    if number >= state.solved || state.done != 0u {
        return;
    }
    factor_block(number);
    var pose: array<f32, 6>;
    for (var i = 0u; i < 6u; i++) {
        for (var j = 0u; j < 6u; j++) {
            pose[i] += state.inverse[6u * i + j] * state.gradient[j];
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        var remainder = -border[COLUMN * 7u * number + axis];
        for (var column = 0u; column < 6u; column++) {
            remainder += pose[column] * border[COLUMN * (7u * number + 1u + column) + axis];
        }
        remainders[3u * number + axis] = remainder;
        steps[3u * number + axis] = vec4<f32>(0.0);
        directions[3u * number + axis] = vec4<f32>(0.0);
        directions[3u * (arrayLength(&directions) / 6u + number) + axis] = vec4<f32>(0.0);
    }
    precondition(number);
}
