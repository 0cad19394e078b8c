// What the change set kernels are told; `PublishSettings` in settings.rs is the CPU side.

struct PublishSettings {
    slots: u32,
    // most records at once
    batch: u32,
    // what may differ unsaid: metres, cosine of an angle, levels of 255, weight
    position_m: f32,
    normal_cos: f32,
    color_levels: f32,
    weight_step: f32,
    // grid of published positions, and the largest that has a place on it
    position_step_m: f32,
    position_max_m: f32,
    // steps of published nodes: metres, and elements of A - I
    node_step_m: f32,
    affine_step: f32,
    // a node that moves nothing within its reach by more than this stays where it is
    settled_m: f32,
    reach_m: f32,
}

// The place that viewers are told.
fn on_grid(point: vec3<f32>, step_m: f32) -> vec3<f32> {
    return round(point / step_m) * step_m;
}

// Whether a surfel has a form in which it can be sent.
fn is_packable(place: vec4<f32>, normal: vec3<f32>) -> bool {
    return all_finite(place.xyz) && all_finite(normal) && dot(normal, normal) > 0.25
        && place.w > 0.0 && place.w < 1.0 && all(abs(place.xyz) < vec3<f32>(settings.position_max_m));
}
