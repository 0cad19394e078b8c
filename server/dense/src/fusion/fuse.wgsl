#import view
#import finite
#import color
#import surfel
#import fusion
#import light
// Registration and running averages (Algorithm 1, Eqs. fusion1-4): each surfel looks at the pixel it projects to. Within
// the gates its depth along the ray, normal and colour are averaged with the measurement. Clearly in front of the measured
// surface, where the camera sees through it, it loses weight; so it does a little behind a surface that faces the same way,
// where tissue that has moved leaves its old place as a second layer. Farther behind, it is hidden and left alone.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: FusionSettings;
@group(0) @binding(2) var<uniform> tone: Tone;
@group(0) @binding(3) var<storage, read> depth: array<f32>;
@group(0) @binding(4) var<storage, read> sigma_z: array<f32>;
@group(0) @binding(5) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> colors: array<u32>;
@group(0) @binding(7) var<storage, read_write> results: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> geometry: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> orientation: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read_write> appearance: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read_write> history: array<vec4<u32>>;
// number and slots of the surfels in view
@group(0) @binding(12) var<storage, read> visible: array<u32>;

fn depth_at(x: i32, y: i32) -> f32 {
    let inside = x >= 0 && y >= 0 && x < i32(view.size.x) && y < i32(view.size.y);
    return select(0.0, depth[u32(y) * view.size.x + u32(x)], inside);
}

// Depth between pixels, bilinear where the four neighbours belong to one surface, else `nearest`.
fn depth_between(at: vec2<f32>, nearest: f32, gate: f32) -> f32 {
    let corner = floor(at);
    let x = i32(corner.x);
    let y = i32(corner.y);
    let four = vec4<f32>(depth_at(x, y), depth_at(x + 1, y), depth_at(x, y + 1), depth_at(x + 1, y + 1));
    if !all(abs(four - nearest) < vec4<f32>(gate)) {
        return nearest;
    }
    let t = at - corner;
    return mix(mix(four.x, four.y, t.x), mix(four.z, four.w, t.x), t.y);
}

// Whether everything measured around a pixel lies between two depths.
fn all_around_between(pixel: vec2<i32>, near: f32, far: f32) -> bool {
    for (var dy = -1; dy <= 1; dy++) {
        for (var dx = -1; dx <= 1; dx++) {
            let neighbour = depth_at(pixel.x + dx, pixel.y + dy);
            if neighbour > 0.0 && !(neighbour >= near && neighbour <= far) {
                return false;
            }
        }
    }
    return true;
}

@compute @workgroup_size(64)
fn fuse(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= visible[0] || atomicLoad(&results[ACCEPTED]) == 0u {
        return;
    }
    let slot = visible[1u + id.x];
    let point = transform_point(view.camera_from_world, geometry[slot].xyz);
    if !all_finite(point) || point.z < 1e-4 {
        return;
    }
    let at = project(view.intrinsics, point);
    let size = vec2<f32>(view.size);
    if !all(at > vec2<f32>(-0.5)) || !all(at < size - 0.5) {
        return;
    }
    let pixel = vec2<u32>(clamp(round(at), vec2<f32>(0.0), size - 1.0));
    let index = pixel.y * view.size.x + pixel.x;
    let measured = depth[index];
    let sigma = sigma_z[index];
    if !(is_finite(measured) && is_finite(sigma)) || measured <= 0.0 || sigma <= 0.0 {
        return;
    }
    let gate = depth_gate(sigma, settings);
    let weight = measurement_weight(sigma, measured, settings);
    let between = depth_between(at, measured, gate);
    if abs(point.z - between) < gate {
        register_surfel(slot, index, point, between, weight);
    } else if is_contradicted(slot, pixel, point.z, gate) {
        orientation[slot].w = max(orientation[slot].w - settings.contradiction_loss * weight, 0.0);
    }
}

fn is_contradicted(slot: u32, pixel: vec2<u32>, depth_m: f32, gate: f32) -> bool {
    let seen_in_world = rotate(view.world_from_camera, normals[pixel.y * view.size.x + pixel.x].xyz);
    let same_facing = dot(orientation[slot].xyz, seen_in_world) > settings.angle_cos_min;
    let at = vec2<i32>(pixel);
    return all_around_between(at, depth_m + max(settings.free_space_gate_m, gate), 1e30)
        || (same_facing && all_around_between(at, depth_m - settings.doubled_gate_m, depth_m - gate));
}

fn register_surfel(slot: u32, pixel: u32, point: vec3<f32>, measured: f32, weight: f32) {
    let normal = orientation[slot];
    let seen = normals[pixel];
    let seen_in_world = rotate(view.world_from_camera, seen.xyz);
    if !all_finite(seen.xyz) || seen.w == 0.0 || dot(normal.xyz, seen_in_world) < settings.angle_cos_min {
        return;
    }
    let total = normal.w + weight;
    let fused_depth = (point.z * normal.w + measured * weight) / total;
    let fused = transform_point(view.world_from_camera, point * (fused_depth / point.z));
    let turned = normalize(normal.xyz * normal.w + seen_in_world * weight);
    if !all_finite(fused) || !all_finite(turned) {
        return;
    }
    let facing = -dot(seen.xyz, normalize(point));
    let radius = disc_radius(fused_depth, view.intrinsics.x, facing, settings.spacing_m);
    geometry[slot] = vec4<f32>(fused, min(geometry[slot].w, radius));
    orientation[slot] = vec4<f32>(turned, min(total, settings.weight_max));
    if has_color(colors[pixel]) {
        mix_color(slot, colors[pixel], weight, light_falloff(point, seen.xyz, settings));
    }
    history[slot].y = settings.frame;
    atomicAdd(&results[REGISTERED_COUNT], 1u);
}

// A colour has its own weight. What is much brighter than the surfel is taken for a highlight and counts less.
fn mix_color(slot: u32, packed: u32, measurement_weight: f32, falloff: f32) {
    let color = appearance[slot];
    let seen = even_color(packed, falloff, tone);
    let glare = max(dot(seen - color.xyz, vec3<f32>(0.299, 0.587, 0.114)), 0.0) / settings.highlight_levels;
    let doubt = select(1.0, 1.0 + glare * glare, color.w > 0.0);
    let weight = color_weight(measurement_weight, falloff, tone) / doubt;
    let total = color.w + weight;
    if !all_finite(seen) || !(total > 0.0) {
        return;
    }
    let mixed = (color.xyz * color.w + seen * weight) / total;
    appearance[slot] = vec4<f32>(mixed, min(total, settings.color_weight_max));
}
