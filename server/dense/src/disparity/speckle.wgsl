// What the four speckle kernels share; `Speckle` in speckle.rs is the CPU side.

struct Speckle {
    // px: neighbours that differ by more belong to different surfaces
    step_max: f32,
    // pixels: smaller surfaces are removed
    area_min: u32,
    padding_a: u32,
    padding_b: u32,
}

const NO_LABEL = 0xffffffffu;

fn connected(a: f32, b: f32) -> bool {
    return known(a) && known(b) && abs(a - b) <= speckle.step_max;
}
