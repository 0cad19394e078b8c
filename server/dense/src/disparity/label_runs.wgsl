// Speckles, step 1 of 4: cuts each row into runs of pixels whose disparities differ by at most `step_max`.
//
// disparities: padded rows, four pixels an element. labels: index of the run's first pixel, NO_LABEL where the disparity is unknown.
// runs: length of the run at its first pixel, 0 elsewhere. areas: zeroed. One invocation per row.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> speckle: Speckle;
@group(0) @binding(2) var<storage, read> disparities: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> labels: array<u32>;
@group(0) @binding(4) var<storage, read_write> runs: array<u32>;
@group(0) @binding(5) var<storage, read_write> areas: array<u32>;

@compute @workgroup_size(32)
fn label_runs(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.height) {
        return;
    }
    let row_start = 4u * id.x * band.words;
    var before = NO_DISPARITY;
    var first = 0u;
    for (var word = 0u; word < band.words; word++) {
        let four = disparities[id.x * band.words + word];
        for (var lane = 0u; lane < 4u; lane++) {
            let index = row_start + 4u * word + lane;
            let here = four[lane];
            if (!connected(before, here)) {
                if (known(before)) {
                    runs[first] = index - first;
                }
                first = index;
            }
            labels[index] = select(NO_LABEL, first, known(here));
            runs[index] = 0u;
            areas[index] = 0u;
            before = here;
        }
    }
    if (known(before)) {
        runs[first] = row_start + 4u * band.words - first;
    }
}
