// Joins what the 3 x 3 cells about each one ask for, as far as they lie within a gate of its plane: then the sparse
// samples of fit_patch.wgsl leave no cell out.
//
// targets: d, z, w per cell (aim_patch.wgsl), unpadded rows. planes: disparity, slopes and more. pooled: d of the cell,
// d and the weighted mean step z - d, summed w, 0. One invocation per cell.

struct Pool {
    // px: gate about the cell's plane
    gate: f32,
    padding_a: f32,
    padding_b: f32,
    padding_c: f32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> pool: Pool;
@group(0) @binding(2) var<storage, read> targets: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> pooled: array<vec4<f32>>;

// Weight and weighted step of the cell at `column`, `p` away from the centre.
fn share_of(row: u32, column: i32, p: vec2<f32>, plane: vec3<f32>) -> vec2<f32> {
    let inner = clamp(column, 0, i32(band.width) - 1);
    let point = targets[row + u32(inner)];
    let on_plane = column == inner && abs(point.x - plane.x - dot(plane.yz, p)) <= pool.gate;
    return select(vec2<f32>(0.0), vec2<f32>(point.z, point.z * (point.y - point.x)), on_plane);
}

@compute @workgroup_size(64)
fn pool_targets(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let index = id.y * band.width + id.x;
    let plane = planes[index].xyz;
    if (!known(plane.x)) {
        pooled[index] = vec4<f32>(NO_DISPARITY, NO_DISPARITY, 0.0, 0.0);
        return;
    }
    let x = i32(id.x);
    var sum = vec2<f32>(0.0);
    for (var v = -1; v <= 1; v++) {
        let y = i32(id.y) + v;
        if (y >= 0 && y < i32(band.height)) {
            let row = u32(y) * band.width;
            sum += share_of(row, x - 1, vec2<f32>(-1.0, f32(v)), plane);
            sum += share_of(row, x, vec2<f32>(0.0, f32(v)), plane);
            sum += share_of(row, x + 1, vec2<f32>(1.0, f32(v)), plane);
        }
    }
    pooled[index] = vec4<f32>(plane.x, plane.x + sum.y / max(sum.x, 1.0e-12), sum.x, 0.0);
}
