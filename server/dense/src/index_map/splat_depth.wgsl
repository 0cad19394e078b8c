#import view
#import finite
#import surfel
// Index map, pass 1: each surfel's disc claims its pixels by depth, the nearest wins, stable ones before all others.
// Keys are stored inverted so that a zeroed buffer is empty and the largest stored key is the nearest.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> splat: SplatSettings;
@group(0) @binding(2) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> history: array<vec4<u32>>;
// number and slots of the surfels in view
@group(0) @binding(5) var<storage, read> visible: array<u32>;
// per cell: the inverted key of the nearest disc, 0 where none
@group(0) @binding(6) var<storage, read_write> nearest: array<atomic<u32>>;
// per visible surfel: inverted key (0: not in view), first cell x | y << 16, last cell x | y << 16
@group(0) @binding(7) var<storage, read_write> footprints: array<vec4<u32>>;

@compute @workgroup_size(64)
fn splat_depth(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= visible[0] {
        return;
    }
    let slot = visible[1u + id.x];
    footprints[id.x] = vec4<u32>(0u);
    let state = history[slot].w;
    if splat.stable_only != 0u && !is_stable(state) {
        return;
    }
    let surfel = geometry[slot];
    let center = transform_point(view.camera_from_world, surfel.xyz);
    let normal = rotate(view.camera_from_world, orientation[slot].xyz);
    let facing = dot(normal, center);
    if !(all_finite(center) && is_finite(facing)) || center.z < 1e-4 || facing >= 0.0 {
        return;
    }
    let scale = f32(splat.scale);
    let intrinsics = vec4<f32>(view.intrinsics.xy * scale, (view.intrinsics.zw + 0.5) * scale - 0.5);
    let cell = project(intrinsics, center);
    let reach = clamp(surfel.w * intrinsics.x / center.z, 0.5, splat.reach_max);
    let size = vec2<f32>(view.size * splat.scale);
    if any(cell + reach < vec2<f32>(0.0)) || any(cell - reach > size - 1.0) {
        return;
    }
    let first = vec2<u32>(max(ceil(cell - reach), vec2<f32>(0.0)));
    let last = vec2<u32>(min(floor(cell + reach), size - 1.0));
    let key = ~(bitcast<u32>(center.z) | select(0x80000000u, 0u, is_stable(state)));
    footprints[id.x] = vec4<u32>(key, first.x | (first.y << 16u), last.x | (last.y << 16u), 0u);
    let own = vec2<u32>(clamp(round(cell), vec2<f32>(0.0), size - 1.0));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let direction = ray(intrinsics, vec2<f32>(f32(x), f32(y)));
            let offset = direction * (facing / dot(normal, direction)) - center;
            if all(vec2<u32>(x, y) == own) || dot(offset, offset) <= surfel.w * surfel.w {
                atomicMax(&nearest[y * view.size.x * splat.scale + x], key);
            }
        }
    }
}
