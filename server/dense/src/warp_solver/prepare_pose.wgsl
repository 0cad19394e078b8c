// Adds the pose's partial sums and the priors E_r and E_p, and inverts the damped 6 x 6 matrix of the pose for the Schur
// complement. One workgroup.

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> partials: array<f32>;
@group(0) @binding(2) var<storage, read_write> state: SolverState;

var<workgroup> sums: array<f32, 28>;

// The left Jacobian's inverse of a small turn: the derivative of its rotation vector by a turn from the left.
fn turn_derivative(turn: vec3<f32>) -> mat3x3<f32> {
    let half = 0.5 * turn;
    let cross_matrix = mat3x3<f32>(
        vec3<f32>(0.0, half.z, -half.y), vec3<f32>(-half.z, 0.0, half.x), vec3<f32>(half.y, -half.x, 0.0));
    let identity = mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    return identity - cross_matrix + (1.0 / 3.0) * cross_matrix * cross_matrix;
}

fn add_priors() {
    let shift = pose_shift(state.present);
    let turn = pose_turn(state.present);
    // d shift = d rho + d phi x shift
    let by_turn = mat3x3<f32>(
        vec3<f32>(0.0, -shift.z, shift.y), vec3<f32>(shift.z, 0.0, -shift.x), vec3<f32>(-shift.y, shift.x, 0.0));
    let turned = turn_derivative(turn);
    for (var i = 0u; i < 3u; i++) {
        state.gradient[i] += settings.w_p * shift[i];
        state.gradient[3u + i] += settings.w_p * dot(by_turn[i], shift) + settings.w_r * dot(turned[i], turn);
        state.matrix[7u * i] += settings.w_p;
        for (var j = 0u; j < 3u; j++) {
            state.matrix[6u * (3u + i) + 3u + j] +=
                settings.w_p * dot(by_turn[i], by_turn[j]) + settings.w_r * dot(turned[i], turned[j]);
            state.matrix[6u * i + 3u + j] += settings.w_p * by_turn[j][i];
            state.matrix[6u * (3u + j) + i] += settings.w_p * by_turn[j][i];
        }
    }
}

fn take_sums() {
    var place = 0u;
    for (var i = 0u; i < 6u; i++) {
        for (var j = i; j < 6u; j++) {
            state.matrix[6u * i + j] = sums[place];
            state.matrix[6u * j + i] = sums[place];
            place += 1u;
        }
        state.gradient[i] = sums[21u + i];
    }
    add_priors();
    state.energy = sums[27] + pose_energy(state.present, settings);
    if state.accepted + state.rejected == 0u {
        state.first_energy = state.energy;
    }
}

// Gauss-Jordan; the matrix is positive definite, so no pivots are sought.
fn invert_damped() {
    var left: array<f32, 36>;
    var right: array<f32, 36>;
    for (var i = 0u; i < 36u; i++) {
        left[i] = state.matrix[i];
        right[i] = 0.0;
    }
    for (var i = 0u; i < 6u; i++) {
        left[7u * i] *= 1.0 + state.damping;
        right[7u * i] = 1.0;
    }
    for (var pivot = 0u; pivot < 6u; pivot++) {
        let scale = 1.0 / left[7u * pivot];
        for (var j = 0u; j < 6u; j++) {
            left[6u * pivot + j] *= scale;
            right[6u * pivot + j] *= scale;
        }
        for (var i = 0u; i < 6u; i++) {
            let factor = select(left[6u * i + pivot], 0.0, i == pivot);
            for (var j = 0u; j < 6u; j++) {
                left[6u * i + j] -= factor * left[6u * pivot + j];
                right[6u * i + j] -= factor * right[6u * pivot + j];
            }
        }
    }
    // without an inverse nothing comes back from the pose: as if it were no unknown
    for (var i = 0u; i < 36u; i++) {
        state.inverse[i] = select(right[i], 0.0, settings.hold_pose != 0u);
    }
}

@compute @workgroup_size(32)
fn prepare_pose(@builtin(local_invocation_index) place: u32) {
    if place < 28u {
        var sum = 0.0;
        for (var i = 0u; i < PARTIALS; i++) {
            sum += partials[28u * i + place];
        }
        sums[place] = sum;
    }
    workgroupBarrier();
    if place != 0u || state.done != 0u {
        return;
    }
    if state.fresh != 0u {
        take_sums();
    }
    invert_damped();
    state.settled = 0u;
    state.started = 0u;
    state.carry = 0.0;
    for (var i = 0u; i < 6u; i++) {
        state.stepped[i] = 0.0;
        state.along[i] = 0.0;
    }
}
