#import view
#import surfel
#import finite
#import shading
// Surfels as discs: two triangles for each slot, cut to a circle. Colours are levels of sRGB, written as they are.

struct Scene {
    // rows of the rotation, with the translation in w (metres)
    camera_from_world: array<vec4<f32>, 3>,
    // clip x and y of a point at z = 1: scale in xy, offset in zw
    clip_from_ray: vec4<f32>,
    // levels 0-255
    background: vec4<f32>,
    // nothing nearer is drawn, metres
    near_m: f32,
    weight_max: f32,
    // share of the way to grey and dark
    fade: f32,
    coloring: u32,
}

struct Corner {
    @builtin(position) place: vec4<f32>,
    @location(0) on_disc: vec2<f32>,
    @location(1) @interpolate(flat) color: vec3<f32>,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> appearance: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> history: array<vec4<u32>>;

// Discs as large as the spacing of a square grid leave holes at its corners; sqrt(2) closes them.
const OVERLAP: f32 = 1.4142;

// Behind everything: its triangle has no area.
fn nowhere() -> Corner {
    return Corner(vec4<f32>(0.0, 0.0, -1.0, 1.0), vec2<f32>(0.0), vec3<f32>(0.0));
}

// A tangent that exists for every normal: of the axis that is least parallel to it.
fn tangent_of(normal: vec3<f32>) -> vec3<f32> {
    let away = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 0.0, 1.0), abs(normal.z) < 0.7);
    return normalize(cross(away, normal));
}

@vertex
fn place_corner(@builtin(vertex_index) index: u32) -> Corner {
    let slot = index / 6u;
    if !is_stable(history[slot].w) {
        return nowhere();
    }
    let surfel = geometry[slot];
    let center = transform_point(scene.camera_from_world, surfel.xyz);
    var normal = rotate(scene.camera_from_world, orientation[slot].xyz);
    let away = -normalize(center);
    var facing = dot(normal, away);
    if !(all_finite(center) && is_finite(facing) && is_finite(surfel.w)) {
        return nowhere();
    }
    // Discs have no inside: both faces are lit alike.
    if facing < 0.0 {
        normal = -normal;
        facing = -facing;
    }
    // (-1,-1) (1,-1) (-1,1), (-1,1) (1,-1) (1,1)
    let number = index % 6u;
    let right = number == 1u || number == 4u || number == 5u;
    let upper = number == 2u || number == 3u || number == 5u;
    let corner = vec2<f32>(select(-1.0, 1.0, right), select(-1.0, 1.0, upper));
    let tangent = tangent_of(normal);
    let point = center + OVERLAP * surfel.w * (corner.x * tangent + corner.y * cross(normal, tangent));
    let in_clip = scene.clip_from_ray.xy * point.xy + scene.clip_from_ray.zw * point.z;
    let confidence = orientation[slot].w / scene.weight_max;
    let color = shaded(scene.coloring, appearance[slot].xyz, normal, facing, confidence);
    return Corner(vec4<f32>(in_clip, scene.near_m, point.z), corner, color);
}

@fragment
fn shade_disc(corner: Corner) -> @location(0) vec4<f32> {
    if dot(corner.on_disc, corner.on_disc) > 1.0 {
        discard;
    }
    let grey = vec3<f32>(dot(corner.color, vec3<f32>(0.30, 0.59, 0.11)));
    let faded = mix(corner.color, mix(grey, scene.background.xyz, 0.55), scene.fade);
    return vec4<f32>(faded / 255.0, 1.0);
}
