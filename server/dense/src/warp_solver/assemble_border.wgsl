#import surfel
#import graph
// Per node, seven columns of twelve: the gradient, and the products with the six unknowns of the pose (the border).

@group(0) @binding(0) var<uniform> settings: SolverSettings;
@group(0) @binding(1) var<storage, read> state: SolverState;
@group(0) @binding(2) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> edges: array<u32>;
@group(0) @binding(4) var<storage, read> solved: array<u32>;
@group(0) @binding(5) var<storage, read> starts: array<u32>;
@group(0) @binding(6) var<storage, read> node_counts: array<u32>;
@group(0) @binding(7) var<storage, read> entries: array<u32>;
@group(0) @binding(8) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read> gradients: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read> in_camera: array<vec4<f32>>;
@group(0) @binding(13) var<storage, read> estimates: array<vec4<f32>>;
// 7 x 3 vectors of four per node
@group(0) @binding(14) var<storage, read_write> border: array<vec4<f32>>;

const COLUMNS: u32 = 7u;

// What a residual's gradient by the node is multiplied with: its value, and its derivatives by the unknowns of the pose.
fn factors(residual: u32) -> array<f32, COLUMNS> {
    let normal = planes[residual].xyz;
    let turn = cross(in_camera[residual].xyz, normal);
    return array<f32, COLUMNS>(in_camera[residual].w, normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
}

// Gradient of E_rot, E_reg and rest: a row for each axis.
fn own_gradient(slot: u32) -> array<vec4<f32>, 3> {
    let a = rows_of(state.present, slot);
    var rows: array<vec4<f32>, 3>;
    for (var axis = 0u; axis < 3u; axis++) {
        rows[axis] = vec4<f32>(settings.w_rest_turn * turn_residual(a, axis), settings.w_rest * a[axis].w);
    }
    for (var p = 0u; p < 3u; p++) {
        for (var q = p; q < 3u; q++) {
            let residual = settings.w_rot * rotation_residual(a, p, q);
            for (var axis = 0u; axis < 3u; axis++) {
                rows[axis][p] += residual * a[axis][q];
                rows[axis][q] += residual * a[axis][p];
            }
        }
    }
    for (var edge = 0u; edge < EDGES; edge++) {
        let other = edges[EDGES * slot + edge];
        if other == NO_NODE {
            break;
        }
        let arm = vec4<f32>(MM * (node_point(nodes[other]) - node_point(nodes[slot])), 1.0);
        let outward = settings.w_reg * edge_residual(state.present, slot, other);
        let inward = settings.w_reg * edge_residual(state.present, other, slot);
        for (var axis = 0u; axis < 3u; axis++) {
            rows[axis] += outward[axis] * arm;
            rows[axis].w -= inward[axis];
        }
    }
    return rows;
}

@compute @workgroup_size(64)
fn assemble_border(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x;
    if number >= state.solved || state.done != 0u || state.fresh == 0u {
        return;
    }
    let slot = solved[number];
    let center = node_point(nodes[slot]);
    var sums: array<vec4<f32>, 3u * COLUMNS>;
    for (var i = starts[slot]; i < starts[slot] + node_counts[slot]; i++) {
        let residual = entries[i] / 4u;
        let gradient = gradients[residual];
        let weight = weights[residual][entries[i] % 4u] * gradient.w;
        let arm = vec4<f32>(MM * (points[residual].xyz - center), 1.0);
        let by = factors(residual);
        for (var column = 0u; column < COLUMNS; column++) {
            let q = (weight * by[column]) * arm;
            for (var axis = 0u; axis < 3u; axis++) {
                sums[3u * column + axis] += gradient[axis] * q;
            }
        }
    }
    let own = own_gradient(slot);
    for (var axis = 0u; axis < 3u; axis++) {
        sums[axis] += own[axis];
    }
    for (var i = 0u; i < 3u * COLUMNS; i++) {
        border[COLUMN * COLUMNS * number + i] = sums[i];
    }
}
