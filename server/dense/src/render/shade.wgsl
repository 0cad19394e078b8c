#import view
#import color
#import shading
// Colours an index map as the scope's own light would: brighter where the surface faces the camera.

struct ShadeSettings {
    // packed, where nothing is
    background: u32,
    // of shading.wgsl
    coloring: u32,
    // weight of a surfel that is as sure as can be
    weight_max: f32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: ShadeSettings;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> appearance: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> pixels: array<u32>;
// metres, 0 where nothing is
@group(0) @binding(7) var<storage, read_write> depth: array<f32>;

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.size.y {
        return;
    }
    let pixel = id.y * view.size.x + id.x;
    let stored = slots[pixel];
    if stored == 0u {
        pixels[pixel] = settings.background;
        depth[pixel] = 0.0;
        return;
    }
    let slot = ~stored;
    let center = transform_point(view.camera_from_world, geometry[slot].xyz);
    let normal = rotate(view.camera_from_world, orientation[slot].xyz);
    let direction = ray(view.intrinsics, vec2<f32>(id.xy));
    let facing = max(-dot(normal, normalize(direction)), 0.0);
    let confidence = orientation[slot].w / settings.weight_max;
    pixels[pixel] = pack_rgb(shaded(settings.coloring, appearance[slot].xyz, normal, facing, confidence));
    let met = dot(normal, center) / dot(normal, direction);
    depth[pixel] = clamp(met, center.z - geometry[slot].w, center.z + geometry[slot].w);
}
