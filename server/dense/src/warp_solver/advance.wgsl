// One step of conjugate gradients: the step grows along the direction, the residual shrinks by its product, and the next
// quotient is found. One invocation per node.

@group(0) @binding(0) var<storage, read> state: SolverState;
@group(0) @binding(1) var<uniform> turn: u32;
@group(0) @binding(2) var<storage, read> factors: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> border: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> directions: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> products: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> steps: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> remainders: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> quotients: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> partials: array<vec4<f32>>;

@compute @workgroup_size(64)
fn advance(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = id.x;
    if number >= state.solved || state.done != 0u || state.settled != 0u {
        return;
    }
    let written = (1u - turn) * (arrayLength(&directions) / 2u);
    for (var axis = 0u; axis < 3u; axis++) {
        let place = 3u * number + axis;
        steps[place] += state.step * directions[written + place];
        remainders[place] -= state.step * products[place];
    }
    precondition(number);
}
