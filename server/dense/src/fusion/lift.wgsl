#import view
#import color
#import surfel
#import fusion
#import light
// Lifts the marked pixels to new surfels behind the ones in use, in pixel order, so that ids and slots ascend together.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: FusionSettings;
@group(0) @binding(2) var<uniform> tone: Tone;
@group(0) @binding(3) var<storage, read> depth: array<f32>;
@group(0) @binding(4) var<storage, read> sigma_z: array<f32>;
@group(0) @binding(5) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> colors: array<u32>;
@group(0) @binding(7) var<storage, read> lifted: array<u32>;
@group(0) @binding(8) var<storage, read> offsets: array<u32>;
@group(0) @binding(9) var<storage, read_write> geometry: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read_write> orientation: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read_write> appearance: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read_write> history: array<vec4<u32>>;

@compute @workgroup_size(64)
fn lift(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.x;
    if pixel >= view.size.x * view.size.y || lifted[pixel] == 0u {
        return;
    }
    let slot = settings.slots + offsets[pixel];
    if slot >= settings.capacity {
        return;
    }
    let at = vec2<f32>(f32(pixel % view.size.x), f32(pixel / view.size.x));
    let direction = ray(view.intrinsics, at);
    let normal = normals[pixel].xyz;
    let facing = -dot(normal, normalize(direction));
    let radius = disc_radius(depth[pixel], view.intrinsics.x, facing, settings.spacing_m);
    let point = transform_point(view.world_from_camera, direction * depth[pixel]);
    let weight = measurement_weight(sigma_z[pixel], depth[pixel], settings);
    let color = colors[pixel];
    let falloff = light_falloff(direction * depth[pixel], normal, settings);
    let known = select(0.0, color_weight(weight, falloff, tone), has_color(color));
    geometry[slot] = vec4<f32>(point, radius);
    orientation[slot] = vec4<f32>(rotate(view.world_from_camera, normal), weight);
    appearance[slot] = vec4<f32>(even_color(color, falloff, tone), known);
    history[slot] = vec4<u32>(settings.next_id + offsets[pixel], settings.frame, settings.frame, ALIVE);
}
