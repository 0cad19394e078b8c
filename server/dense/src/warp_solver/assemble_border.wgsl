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

// What a residual's gradient by the node is multiplied with: its value, or its derivative by one unknown of the pose.
fn factor(residual: u32, column: u32) -> f32 {
    let normal = planes[residual].xyz;
    if column == 0u {
        return in_camera[residual].w;
    }
    if column < 4u {
        return normal[column - 1u];
    }
    return cross(in_camera[residual].xyz, normal)[column - 4u];
}

// Gradient of E_rot, E_reg and rest: row `axis`.
fn own_gradient(slot: u32, axis: u32) -> vec4<f32> {
    let a = rows_of(state.present, slot);
    var row = vec4<f32>(settings.w_rest_turn * turn_residual(a, axis), settings.w_rest * a[axis].w);
    for (var p = 0u; p < 3u; p++) {
        for (var q = p; q < 3u; q++) {
            let residual = settings.w_rot * rotation_residual(a, p, q);
            row[p] += residual * a[axis][q];
            row[q] += residual * a[axis][p];
        }
    }
    for (var edge = 0u; edge < EDGES; edge++) {
        let other = edges[EDGES * slot + edge];
        if other == NO_NODE {
            break;
        }
        let arm = vec4<f32>(MM * (node_point(nodes[other]) - node_point(nodes[slot])), 1.0);
        row += settings.w_reg * edge_residual(state.present, slot, other)[axis] * arm;
        row.w -= settings.w_reg * edge_residual(state.present, other, slot)[axis];
    }
    return row;
}

@compute @workgroup_size(64)
fn assemble_border(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x / 7u;
    let column = id.x % 7u;
    if number >= state.solved || state.done != 0u || state.fresh == 0u {
        return;
    }
    let slot = solved[number];
    let center = node_point(nodes[slot]);
    var sum: array<vec4<f32>, 3>;
    for (var i = starts[slot]; i < starts[slot] + node_counts[slot]; i++) {
        let residual = entries[i] / 4u;
        let scale = weights[residual][entries[i] % 4u] * gradients[residual].w * factor(residual, column);
        let q = scale * vec4<f32>(MM * (points[residual].xyz - center), 1.0);
        for (var axis = 0u; axis < 3u; axis++) {
            sum[axis] += gradients[residual][axis] * q;
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        var own = vec4<f32>(0.0);
        if column == 0u {
            own = own_gradient(slot, axis);
        }
        border[COLUMN * id.x + axis] = sum[axis] + own;
    }
}
