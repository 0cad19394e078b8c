#import view
#import finite
// Where the tissue is that each patch of this frame's picture shows: there the next frames follow it from.

@group(0) @binding(0) var<uniform> settings: FlowSettings;
@group(0) @binding(1) var<storage, read> view: View;
@group(0) @binding(2) var<storage, read> depth: array<f32>;
// in world, m; w is 1 where there is some
@group(0) @binding(3) var<storage, read_write> tissue: array<vec4<f32>>;

@compute @workgroup_size(64)
fn lift_patches(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= settings.columns * settings.rows {
        return;
    }
    let centre = patch_centre(id.x);
    var lifted = vec4<f32>(0.0);
    if inside(centre) {
        let z = depth[index_of(centre)];
        let point = transform_point(view.world_from_camera, ray(view.intrinsics, vec2<f32>(centre)) * z);
        if is_finite(z) && z > 0.0 && all_finite(point) {
            lifted = vec4<f32>(point, 1.0);
        }
    }
    tissue[id.x] = lifted;
}
