// Speckles, step 3 of 4: adds each run's length to the area of its component. One invocation per padded pixel.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<storage, read> labels: array<u32>;
@group(0) @binding(2) var<storage, read> runs: array<u32>;
@group(0) @binding(3) var<storage, read_write> areas: array<atomic<u32>>;

@compute @workgroup_size(64)
fn measure_segments(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let index = 4u * id.y * band.words + id.x;
    if (runs[index] == 0u) {
        return;
    }
    var root = index;
    while (labels[root] != root) {
        root = labels[root];
    }
    atomicAdd(&areas[root], runs[index]);
}
