// A picture laid over a rectangle of the target.

// left, top, right, bottom in clip space
@group(0) @binding(0) var<uniform> place: vec4<f32>;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var smoothing: sampler;

struct Corner {
    @builtin(position) place: vec4<f32>,
    @location(0) share: vec2<f32>,
}

@vertex
fn place_overlay(@builtin(vertex_index) index: u32) -> Corner {
    let share = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    return Corner(vec4<f32>(mix(place.xy, place.zw, share), 0.0, 1.0), share);
}

@fragment
fn shade_overlay(corner: Corner) -> @location(0) vec4<f32> {
    return textureSample(picture, smoothing, corner.share);
}
