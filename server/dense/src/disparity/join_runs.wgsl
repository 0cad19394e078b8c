// Speckles, step 2 of 4: joins runs that touch between rows, by union-find towards the smallest index (Playne and
// Hawick 2018). Which label a component ends with does not depend on the order of the invocations.
//
// labels: step 1; a chain of labels leads to the smallest index of the component. One invocation per padded pixel.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> speckle: Speckle;
@group(0) @binding(2) var<storage, read> disparities: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> runs: array<u32>;
@group(0) @binding(4) var<storage, read_write> labels: array<atomic<u32>>;

fn disparity(index: u32) -> f32 {
    return disparities[index >> 2u][index & 3u];
}

fn root_of(index: u32) -> u32 {
    var root = index;
    loop {
        let parent = atomicLoad(&labels[root]);
        if (parent == root) {
            break;
        }
        root = parent;
    }
    return root;
}

fn unite(first: u32, second: u32) {
    var a = first;
    var b = second;
    loop {
        a = root_of(a);
        b = root_of(b);
        if (a == b) {
            break;
        }
        let high = max(a, b);
        let low = min(a, b);
        let parent = atomicMin(&labels[high], low);
        if (parent == high) {
            break;
        }
        // someone else moved `high` in between: join what it then pointed to
        a = parent;
        b = low;
    }
}

@compute @workgroup_size(64)
fn join_runs(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y == 0u || id.y >= band.height) {
        return;
    }
    let index = 4u * id.y * band.words + id.x;
    let above = index - 4u * band.words;
    if (!connected(disparity(index), disparity(above))) {
        return;
    }
    // the pixel to the left has joined the same two runs
    let same_runs = id.x > 0u && runs[index] == 0u && runs[above] == 0u;
    if (same_runs && connected(disparity(index - 1u), disparity(above - 1u))) {
        return;
    }
    unite(index, above);
}
