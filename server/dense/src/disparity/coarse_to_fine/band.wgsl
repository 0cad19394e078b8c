// What the band kernels share: the disparity of index 0 of the 16 about a prior one.

fn band_start(prior: f32) -> i32 {
    return i32(clamp(floor(prior + 0.5), -32768.0, 32768.0)) - 8;
}
