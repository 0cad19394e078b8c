#import fusion
// Decides on the GPU whether the frame is fused: a mean error above the limit means a wrong pose or a wrong depth,
// unless too little of the model is in view to tell.

@group(0) @binding(0) var<uniform> settings: FusionSettings;
@group(0) @binding(1) var<storage, read_write> results: array<u32>;

@compute @workgroup_size(1)
fn judge_frame() {
    var compared = 0u;
    var sum = 0.0;
    for (var bin = 0u; bin < ERROR_BINS; bin++) {
        let count = results[HISTOGRAM + bin] + results[HELD_OUT_HISTOGRAM + bin];
        compared += count;
        sum += (f32(bin) + 0.5) * f32(count);
    }
    let mean = sum * settings.error_bin_m / f32(max(compared, 1u));
    let unknown = f32(compared) < settings.overlap_min * f32(results[MEASURED]);
    let accepted = settings.accept_always != 0u || unknown || mean <= settings.error_max_m;
    results[ACCEPTED] = select(0u, 1u, accepted);
}
