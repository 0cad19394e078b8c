// The pose correction. A kernel that imports this declares `state`.

fn corrected(half: u32, camera_point_mm: vec3<f32>) -> vec3<f32> {
    let point = vec4<f32>(camera_point_mm, 1.0);
    return vec3<f32>(dot(state.poses[3u * half], point), dot(state.poses[3u * half + 1u], point),
        dot(state.poses[3u * half + 2u], point));
}

fn pose_shift(half: u32) -> vec3<f32> {
    return vec3<f32>(state.poses[3u * half].w, state.poses[3u * half + 1u].w, state.poses[3u * half + 2u].w);
}

// The rotation vector of a small turn (exact to its fifth power).
fn pose_turn(half: u32) -> vec3<f32> {
    let a = state.poses[3u * half];
    let b = state.poses[3u * half + 1u];
    let c = state.poses[3u * half + 2u];
    let sine = 0.5 * vec3<f32>(c.y - b.z, a.z - c.x, b.x - a.y);
    let square = dot(sine, sine);
    return sine * (1.0 + square * (1.0 / 6.0 + square * 3.0 / 40.0));
}

fn pose_energy(half: u32, settings: SolverSettings) -> f32 {
    let shift = pose_shift(half);
    let turn = pose_turn(half);
    return settings.w_p * dot(shift, shift) + settings.w_r * dot(turn, turn);
}
