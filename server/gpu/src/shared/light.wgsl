// Light of the scope on tissue, and what remains of a colour when it is taken out. A kernel that imports this imports
// `color` and `fusion` too. `Tone` in dense/src/tone/mod.rs is the CPU side.

// How one frame's levels follow from the model's: observed = gain * falloff * model + bias, per channel.
struct Tone {
    // w: 1 once it was fitted to a frame
    gain: vec4<f32>,
    bias: vec4<f32>,
}

const FACING_MIN: f32 = 0.2;
const EXPOSURE_WEIGHT_MIN: f32 = 0.02;

// Share of the scope's light that a place sends back: cos / d^2 of a lamp at the camera, less to the sides of its cone. 1
// for a white wall across the axis at the reference distance.
fn light_falloff(point_in_camera: vec3<f32>, normal_in_camera: vec3<f32>, settings: FusionSettings) -> f32 {
    if settings.near_field == 0u {
        return 1.0;
    }
    let square = dot(point_in_camera, point_in_camera);
    let direction = point_in_camera * inverseSqrt(square);
    let facing = clamp(-dot(normal_in_camera, direction), FACING_MIN, 1.0);
    let reference = settings.reference_distance_m;
    return facing * (reference * reference / square) * pow(max(direction.z, 0.01), settings.axis_power);
}

// The colour under even light.
fn even_color(packed: u32, falloff: f32, tone: Tone) -> vec3<f32> {
    return max((unpack_rgb(packed) - tone.bias.xyz) / (tone.gain.xyz * falloff), vec3<f32>(0.0));
}

// What such a colour weighs: its noise is that of the picture over the light.
fn color_weight(weight: f32, falloff: f32, tone: Tone) -> f32 {
    let exposure = (tone.gain.x + tone.gain.y + tone.gain.z) / 3.0 * falloff;
    return weight * clamp(exposure * exposure, EXPOSURE_WEIGHT_MIN, 1.0);
}
