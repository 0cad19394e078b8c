// A pinhole view of the world; `View` in dense/src/view.rs is its CPU side. Pixel centres are at integers.

struct View {
    // fx, fy, cx, cy in pixels
    intrinsics: vec4<f32>,
    // rows of the rotation, with the translation in w (metres)
    camera_from_world: array<vec4<f32>, 3>,
    world_from_camera: array<vec4<f32>, 3>,
    // columns, rows
    size: vec2<u32>,
    padding: vec2<u32>,
}

fn transform_point(transform: array<vec4<f32>, 3>, point: vec3<f32>) -> vec3<f32> {
    let homogeneous = vec4<f32>(point, 1.0);
    return vec3<f32>(
        dot(transform[0], homogeneous), dot(transform[1], homogeneous), dot(transform[2], homogeneous));
}

fn rotate(transform: array<vec4<f32>, 3>, direction: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(transform[0].xyz, direction), dot(transform[1].xyz, direction), dot(transform[2].xyz, direction));
}

// The pixel of a point in the camera frame; meaningless for z <= 0.
fn project(intrinsics: vec4<f32>, point: vec3<f32>) -> vec2<f32> {
    return point.xy / point.z * intrinsics.xy + intrinsics.zw;
}

// The direction of a pixel's ray, scaled to z = 1.
fn ray(intrinsics: vec4<f32>, pixel: vec2<f32>) -> vec3<f32> {
    return vec3<f32>((pixel - intrinsics.zw) / intrinsics.xy, 1.0);
}
