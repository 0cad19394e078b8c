// What both change set kernels are told; `PublishSettings` in mod.rs is the CPU side.

struct PublishSettings {
    slots: u32,
    // most records at once
    batch: u32,
    // what may differ unsaid: metres, cosine of an angle, levels of 255, weight
    position_m: f32,
    normal_cos: f32,
    color_levels: f32,
    weight_step: f32,
}
