#import view
#import finite
#import color
#import fusion
#import light
// Pairs of what the model would show under even light, times the fall-off of light there, and what is observed: sums over
// every 4th pixel of every 4th row, for the fit of gain and bias. Each invocation takes every 256th of these pixels and
// keeps its sums in registers.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: FusionSettings;
@group(0) @binding(2) var<uniform> index_scale: u32;
@group(0) @binding(3) var<storage, read> depth: array<f32>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> colors: array<u32>;
@group(0) @binding(6) var<storage, read> slots: array<u32>;
@group(0) @binding(7) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> appearance: array<vec4<f32>>;
// four rows per invocation: per channel the sums of model, observed, model^2, model * observed; then pairs, the sum of the
// fall-off over measured pixels, and their number
@group(0) @binding(9) var<storage, read_write> sums: array<vec4<f32>>;

const STEP: u32 = 4u;
const INVOCATIONS: u32 = 256u;
// levels beyond which a camera clips or shows noise
const LEVEL_MIN: f32 = 8.0;
const LEVEL_MAX: f32 = 245.0;

fn within(levels: vec3<f32>) -> bool {
    return all(levels > vec3<f32>(LEVEL_MIN)) && all(levels < vec3<f32>(LEVEL_MAX));
}

@compute @workgroup_size(64)
fn sample_tone(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= INVOCATIONS {
        return;
    }
    var channels = array<vec4<f32>, 3>();
    var counts = vec4<f32>(0.0);
    let columns = view.size.x / STEP;
    let samples = columns * (view.size.y / STEP);
    for (var sample = id.x; sample < samples; sample += INVOCATIONS) {
        let at = vec2<u32>(sample % columns, sample / columns) * STEP;
        let pixel = at.y * view.size.x + at.x;
        let measured = depth[pixel];
        let normal = normals[pixel];
        if !(is_finite(measured) && all_finite(normal.xyz)) || measured <= 0.0 || normal.w == 0.0 || !has_color(colors[pixel]) {
            continue;
        }
        let falloff = light_falloff(ray(view.intrinsics, vec2<f32>(at)) * measured, normal.xyz, settings);
        counts += vec4<f32>(0.0, falloff, 1.0, 0.0);
        let cell = at * index_scale + index_scale / 2u;
        let stored = slots[cell.y * view.size.x * index_scale + cell.x];
        if stored == 0u {
            continue;
        }
        let center = transform_point(view.camera_from_world, geometry[~stored].xyz);
        let known = appearance[~stored];
        let model = known.xyz * falloff;
        let observed = unpack_rgb(colors[pixel]);
        if !(abs(center.z - measured) < settings.gate_m) || known.w <= 0.0 || !all_finite(model) || !within(observed) {
            continue;
        }
        counts.x += 1.0;
        for (var channel = 0u; channel < 3u; channel++) {
            let m = model[channel];
            let o = observed[channel];
            channels[channel] += vec4<f32>(m, o, m * m, m * o);
        }
    }
    for (var row = 0u; row < 3u; row++) {
        sums[4u * id.x + row] = channels[row];
    }
    sums[4u * id.x + 3u] = counts;
}
