#import surfel
#import graph
// One product of conjugate gradients, one invocation per node and axis: the next direction p = z + carry p_before, and
// q = (H + damping diag H - B C^-1 B^T) p. The neighbours' directions are computed on the way.

@group(0) @binding(0) var<storage, read> state: SolverState;
@group(0) @binding(1) var<uniform> turn: u32;
@group(0) @binding(2) var<storage, read> edges: array<u32>;
@group(0) @binding(3) var<storage, read> solved: array<u32>;
@group(0) @binding(4) var<storage, read> solve_index: array<u32>;
@group(0) @binding(5) var<storage, read> own_blocks: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> blocks: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> border: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> quotients: array<vec4<f32>>;
// two halves: the direction before, and the one written; `turn` says which is which
@group(0) @binding(9) var<storage, read_write> directions: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read_write> products: array<vec4<f32>>;
// p . q per node and axis
@group(0) @binding(11) var<storage, read_write> curvatures: array<f32>;

fn half_start(half: u32) -> u32 {
    return half * (arrayLength(&directions) / 2u);
}

fn direction(number: u32, axis: u32) -> vec4<f32> {
    let place = 3u * number + axis;
    return quotients[place] + state.carry * directions[half_start(turn) + place];
}

fn times_own_block(number: u32, axis: u32) -> vec4<f32> {
    var product = vec4<f32>(0.0);
    var diagonal = vec4<f32>(0.0);
    for (var c = 0u; c < 4u; c++) {
        let row = OWN * number + 3u * (4u * axis + c);
        diagonal[c] = own_blocks[row + axis][c];
        for (var other = 0u; other < 3u; other++) {
            product[c] += dot(own_blocks[row + other], direction(number, other));
        }
    }
    return product + state.damping * diagonal * direction(number, axis);
}

fn times_neighbours(number: u32, axis: u32) -> vec4<f32> {
    var product = vec4<f32>(0.0);
    let slot = solved[number];
    for (var edge = 0u; edge < EDGES; edge++) {
        let neighbour = edges[EDGES * slot + edge];
        if neighbour == NO_NODE {
            break;
        }
        let other = solve_index[neighbour];
        if other == NO_NODE {
            continue;
        }
        for (var other_axis = 0u; other_axis < 3u; other_axis++) {
            let p = direction(other, other_axis);
            let block = EDGE * (EDGES * number + edge) + 4u * axes(axis, other_axis);
            product += vec4<f32>(dot(blocks[block], p), dot(blocks[block + 1u], p), dot(blocks[block + 2u], p),
                dot(blocks[block + 3u], p));
        }
    }
    return product;
}

@compute @workgroup_size(64)
fn multiply(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x / 3u;
    let axis = id.x % 3u;
    if number >= state.solved || state.done != 0u || state.settled != 0u {
        return;
    }
    var product = times_own_block(number, axis) + times_neighbours(number, axis);
    for (var column = 0u; column < 6u; column++) {
        product -= state.pulled[column] * border[COLUMN * (7u * number + 1u + column) + axis];
    }
    let own = direction(number, axis);
    directions[half_start(1u - turn) + id.x] = own;
    products[id.x] = product;
    curvatures[id.x] = dot(own, product);
}
