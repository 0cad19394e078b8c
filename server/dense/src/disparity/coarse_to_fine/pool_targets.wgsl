// Joins what the 3 x 3 cells about each one ask for, as far as they lie within a gate of its plane: then the sparse
// samples of fit_patch.wgsl leave no cell out.
//
// targets: per cell (aim_patch.wgsl), unpadded rows. planes: disparity, slopes and more. pooled: d of the cell, the
// weighted mean step, the summed weight. One invocation per block of 2 x 2 cells.

struct Pool {
    // px: gate about the cell's plane
    gate: f32,
    padding_a: f32,
    padding_b: f32,
    padding_c: f32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> pool: Pool;
@group(0) @binding(2) var<storage, read> targets: array<PatchTarget>;
@group(0) @binding(3) var<storage, read> planes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> pooled: array<PatchTarget>;

// What four cells of a row ask for.
struct Row {
    disparity: vec4<f32>,
    step: vec4<f32>,
    weight: vec4<f32>,
}

fn asked_at(x: i32, y: i32) -> vec3<f32> {
    if (x < 0 || y < 0 || x >= i32(band.width) || y >= i32(band.height)) {
        return vec3<f32>(NO_DISPARITY, 0.0, 0.0);
    }
    let point = targets[u32(y) * band.width + u32(x)];
    return vec3<f32>(point.disparity, wish_of(point));
}

fn row_at(x: i32, y: i32) -> Row {
    let a = asked_at(x, y);
    let b = asked_at(x + 1, y);
    let c = asked_at(x + 2, y);
    let d = asked_at(x + 3, y);
    return Row(vec4<f32>(a.x, b.x, c.x, d.x), vec4<f32>(a.y, b.y, c.y, d.y), vec4<f32>(a.z, b.z, c.z, d.z));
}

// Weight and weighted step of the row's first or last three cells that lie on the plane, `down` rows away from it.
fn share_of(row: Row, is_last: bool, down: f32, plane: vec3<f32>) -> vec2<f32> {
    let disparity = select(row.disparity.xyz, row.disparity.yzw, is_last);
    let step = select(row.step.xyz, row.step.yzw, is_last);
    let weight = select(row.weight.xyz, row.weight.yzw, is_last);
    let off = disparity - plane.x - plane.y * vec3<f32>(-1.0, 0.0, 1.0) - plane.z * down;
    let on_plane = select(vec3<f32>(0.0), weight, abs(off) <= vec3<f32>(pool.gate));
    return vec2<f32>(on_plane.x + on_plane.y + on_plane.z, dot(on_plane, step));
}

fn write(x: u32, y: u32, above: Row, here: Row, below: Row, is_last: bool) {
    if (x >= band.width || y >= band.height) {
        return;
    }
    let index = y * band.width + x;
    let plane = planes[index].xyz;
    let sum = share_of(above, is_last, -1.0, plane) + share_of(here, is_last, 0.0, plane)
        + share_of(below, is_last, 1.0, plane);
    let joined = target_of(plane.x, sum.y / max(sum.x, 1.0e-12), sum.x);
    let nothing = target_of(NO_DISPARITY, 0.0, 0.0);
    if (known(plane.x)) {
        pooled[index] = joined;
    } else {
        pooled[index] = nothing;
    }
}

@compute @workgroup_size(64)
fn pool_targets(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = 2u * id.x;
    let y = 2u * id.y;
    if (x >= band.width || y >= band.height) {
        return;
    }
    let first = row_at(i32(x) - 1, i32(y) - 1);
    let second = row_at(i32(x) - 1, i32(y));
    let third = row_at(i32(x) - 1, i32(y) + 1);
    let fourth = row_at(i32(x) - 1, i32(y) + 2);
    write(x, y, first, second, third, false);
    write(x + 1u, y, first, second, third, true);
    write(x, y + 1u, second, third, fourth, false);
    write(x + 1u, y + 1u, second, third, fourth, true);
}
