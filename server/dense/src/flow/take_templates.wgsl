#import view
// What the patches of this frame's picture look like: there the next frames follow them from, and none of it changes
// while they do. One invocation per sample, `id.x` the patch.

@group(0) @binding(0) var<uniform> settings: FlowSettings;
@group(0) @binding(1) var<storage, read> view: View;
@group(0) @binding(2) var<storage, read> depth: array<f32>;
// grey values, negative where the picture does not show the tissue
@group(0) @binding(3) var<storage, read> grey: array<f32>;
// per sample distance (4, 2, 1), sample and patch: grey value, its gradient, 1 where the sample is the patch's, else 0
@group(0) @binding(4) var<storage, read_write> templates: array<vec4<f32>>;

// `spread` pixels lie between the samples, and as many to both sides of one between the values of its gradient.
fn sample_at(centre: vec2<i32>, offset: vec2<i32>, spread: i32) -> vec4<f32> {
    let at = centre + offset;
    if !inside(at - spread) || !inside(at + spread) {
        return vec4<f32>(0.0);
    }
    let value = grey[index_of(at)];
    let across = vec2<f32>(grey[index_of(at - vec2<i32>(spread, 0))], grey[index_of(at + vec2<i32>(spread, 0))]);
    let down = vec2<f32>(grey[index_of(at - vec2<i32>(0, spread))], grey[index_of(at + vec2<i32>(0, spread))]);
    let is_shown = min(min(min(across.x, across.y), min(down.x, down.y)), value) >= 0.0;
    let is_own = on_surface(depth[index_of(centre)], depth[index_of(at)], offset, view.intrinsics.x);
    let gradient = vec2<f32>(across.y - across.x, down.y - down.x) / f32(2 * spread);
    return vec4<f32>(value, gradient, select(0.0, 1.0, is_shown && is_own));
}

@compute @workgroup_size(64)
fn take_templates(@builtin(global_invocation_id) id: vec3<u32>) {
    let patches = settings.columns * settings.rows;
    if id.x >= patches || id.y >= SPREADS * samples_of(settings.radius) {
        return;
    }
    let sample = i32(id.y % samples_of(settings.radius));
    let spread = spread_of(id.y / samples_of(settings.radius));
    let side = 2 * settings.radius + 1;
    let offset = spread * (vec2<i32>(sample % side, sample / side) - settings.radius);
    templates[id.y * patches + id.x] = sample_at(patch_centre(id.x), offset, spread);
}
