// Speckles, step 4 of 4: components smaller than `area_min` lose their disparity. One invocation per four pixels.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> speckle: Speckle;
@group(0) @binding(2) var<storage, read> labels: array<u32>;
@group(0) @binding(3) var<storage, read> areas: array<u32>;
@group(0) @binding(4) var<storage, read_write> disparities: array<vec4<f32>>;

fn is_speckle(index: u32) -> bool {
    if (labels[index] == NO_LABEL) {
        return false;
    }
    var root = labels[index];
    while (labels[root] != root) {
        root = labels[root];
    }
    return areas[root] < speckle.area_min;
}

@compute @workgroup_size(64)
fn drop_speckles(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let word = id.y * band.words + id.x;
    let four = disparities[word];
    var speckles = vec4<bool>();
    for (var lane = 0u; lane < 4u; lane++) {
        speckles[lane] = is_speckle(4u * word + lane);
    }
    disparities[word] = select(four, vec4<f32>(NO_DISPARITY), speckles);
}
