// The settings of one fused frame; `FusionSettings` in dense/src/fusion/settings.rs is the CPU side. Metres, frames.

struct FusionSettings {
    // slots in use before this frame, and slots there are
    slots: u32,
    capacity: u32,
    // index of this frame, and id of the next new surfel
    frame: u32,
    next_id: u32,
    // registration: depth gate, the same in standard deviations, cosine of the largest angle
    gate_m: f32,
    gate_sigmas: f32,
    angle_cos_min: f32,
    // the standard deviation at which a measurement weighs 1, per square of its depth (1/m), and its least weight
    reference_sigma_per_square_depth: f32,
    weight_min: f32,
    weight_max: f32,
    weight_stable: f32,
    unseen_frames_max: u32,
    // a surfel farther in front of the measured surface is contradicted: it loses so much per measurement weight
    free_space_gate_m: f32,
    contradiction_loss: f32,
    // point grid, and the radius around a registered surfel in which no new one is made
    spacing_m: f32,
    cover_radius_m: f32,
    // places in the claim table less one (a power of two), and the seed of its hash
    table_mask: u32,
    seed: u32,
    // statistics: bin width; rejection: mean error, least share of measured pixels that show the model, and 1 to
    // fuse whatever the error
    error_bin_m: f32,
    error_max_m: f32,
    overlap_min: f32,
    accept_always: u32,
    // a surfel less far behind a measured surface that faces the same way is contradicted too
    doubled_gate_m: f32,
    // colour: 1 where light falls off as from a lamp at the camera, the distance at which it counts as 1, the power of its
    // cone, the most weight, and levels by which a highlight is brighter than tissue
    near_field: u32,
    reference_distance_m: f32,
    axis_power: f32,
    color_weight_max: f32,
    highlight_levels: f32,
}

// Places in the `results` of a frame.
const MEASURED: u32 = 0u;
const ACCEPTED: u32 = 1u;
// surfels that died, became stable, registered to a pixel, and were stable but died or are no longer
const DIED: u32 = 2u;
const BECAME_STABLE: u32 = 3u;
const REGISTERED_COUNT: u32 = 4u;
const LOST_STABILITY: u32 = 5u;
const HISTOGRAM: u32 = 8u;
const ERROR_BINS: u32 = 1024u;
// the same histogram of the held-out pixels, which are not in the first
const HELD_OUT_HISTOGRAM: u32 = 1032u;

// Standard deviation in units of the one at which a measurement of this depth weighs 1.
fn relative_spread(sigma_m: f32, depth_m: f32, settings: FusionSettings) -> f32 {
    return sigma_m / (settings.reference_sigma_per_square_depth * depth_m * depth_m);
}

// A measurement's weight falls with its variance; 1 at the reference spread or better.
fn measurement_weight(sigma_m: f32, depth_m: f32, settings: FusionSettings) -> f32 {
    let spread = max(relative_spread(sigma_m, depth_m, settings), 1e-6);
    return clamp(1.0 / (spread * spread), settings.weight_min, 1.0);
}

// How far a depth may be from a surfel of the same surface.
fn depth_gate(sigma_m: f32, settings: FusionSettings) -> f32 {
    return max(settings.gate_m, settings.gate_sigmas * sigma_m);
}

// Radius of the disc that stands for a pixel: half a pixel's diagonal on the surface, and at least what closes the
// gaps of a point grid that holds one surfel somewhere in each cell.
fn disc_radius(depth_m: f32, focal_px: f32, facing_cos: f32, spacing_m: f32) -> f32 {
    let pixel = 0.70710678 * depth_m / focal_px / max(facing_cos, 0.25);
    return max(pixel, 0.9 * spacing_m);
}
