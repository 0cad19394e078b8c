// What the kernels of the solver share; settings.rs and state.rs are the CPU side.
//
// Unknowns of a node are three rows, each a row of A and the same component of t in millimetres (the paper's weights are
// for millimetres, and so scaled the blocks are well conditioned); those of the pose are a shift (mm) and a turn (rad),
// applied from the left to camera points. Energies are sums of weighted squares, gradients half their derivative.

struct SolverSettings {
    // residuals: a grid of pixels, so many apart, and behind it three per match
    columns: u32,
    rows: u32,
    stride: u32,
    // and how many of the matches, which come first, are patches that were followed
    matches: u32,
    patches: u32,
    // most nodes solved
    room: u32,
    // weights of the paper, and of a node at rest
    w_rot: f32,
    w_reg: f32,
    w_data: f32,
    w_corr: f32,
    w_flow: f32,
    w_r: f32,
    w_p: f32,
    w_rest: f32,
    w_rest_turn: f32,
    // where the kernel turns linear, in millimetres at the reference spread
    huber_mm: f32,
    match_huber_mm: f32,
    // association: distance, cosine of the largest angle
    gate_m: f32,
    angle_cos_min: f32,
    // a measurement of this standard deviation has weight 1
    reference_sigma_m: f32,
    damping: f32,
    // relative decrease of the energy, and relative residual, that end the two loops
    energy_tolerance: f32,
    residual_tolerance: f32,
    // 1 where held-out pixels give no residual
    hold_out: u32,
    // 1 where the camera is at rest: its pose is no unknown
    hold_pose: u32,
}

struct SolverState {
    // which of the two estimates is the present one
    present: u32,
    // 1 where the present estimate is new, so that its residuals must be found
    fresh: u32,
    // 1 where the whole solve, or its present linear system, is done
    done: u32,
    settled: u32,
    solved: u32,
    observed: u32,
    accepted: u32,
    rejected: u32,
    damping: f32,
    energy: f32,
    first_energy: f32,
    // conjugate gradients: step, share of the last direction, r . z now and at first
    step: f32,
    carry: f32,
    descent: f32,
    first_descent: f32,
    started: u32,
    // two poses as three rows: camera points under the tracker's pose go to camera points, millimetres
    poses: array<vec4<f32>, 6>,
    // of the pose: gradient, matrix, inverse of the damped matrix
    gradient: array<f32, 6>,
    matrix: array<f32, 36>,
    inverse: array<f32, 36>,
    // the border's transpose times the present direction, that times the inverse, and times the step so far
    along: array<f32, 6>,
    pulled: array<f32, 6>,
    stepped: array<f32, 6>,
}

const EDGES: u32 = 20u;
// Runs of residuals, in each of which a node's are counted for themselves
const RUNS_OF_RESIDUALS: u32 = 64u;
// Five bits that name no edge
const NO_EDGE: u32 = 31u;
const PARTIALS: u32 = 512u;
// Vectors of four per node: of its own block, of the block of one edge, of a column of the border
const OWN: u32 = 36u;
const EDGE: u32 = 24u;
const COLUMN: u32 = 3u;
const MM: f32 = 1000.0;

// Place of a pair of axes in a symmetric 3 x 3 matrix: xx xy xz yy yz zz.
fn axes(a: u32, b: u32) -> u32 {
    return min(a, b) + max(a, b) + select(0u, 1u, min(a, b) > 0u);
}

fn residual_count(settings: SolverSettings) -> u32 {
    return settings.columns * settings.rows + 3u * settings.matches;
}

// The run that a residual lies in.
fn run_of(residual: u32, settings: SolverSettings) -> u32 {
    let longest = (residual_count(settings) + RUNS_OF_RESIDUALS - 1u) / RUNS_OF_RESIDUALS;
    return residual / longest;
}

// Huber's kernel of a residual with weight and threshold `robust`: weighted energy, weight of the square.
fn huber(residual_mm: f32, robust: vec2<f32>) -> vec2<f32> {
    let size = abs(residual_mm);
    if size <= robust.y {
        return vec2<f32>(robust.x * size * size, robust.x);
    }
    return vec2<f32>(robust.x * robust.y * (2.0 * size - robust.y), robust.x * robust.y / size);
}
