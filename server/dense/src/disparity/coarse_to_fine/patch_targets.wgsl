// What a cell asks for, in two words: aim_patch.wgsl writes it, pool_targets.wgsl joins it, fit_patch.wgsl fits it.

struct PatchTarget {
    // px: the cell's present disparity
    disparity: f32,
    // halves: the step that the cell asks for (px), and the root of its weight, that is of its texture
    step_and_texture: u32,
}

fn target_of(disparity: f32, step: f32, weight: f32) -> PatchTarget {
    return PatchTarget(disparity, pack2x16float(vec2<f32>(step, sqrt(weight))));
}

// Step and weight.
fn wish_of(asked: PatchTarget) -> vec2<f32> {
    let halves = unpack2x16float(asked.step_and_texture);
    return vec2<f32>(halves.x, halves.y * halves.y);
}
