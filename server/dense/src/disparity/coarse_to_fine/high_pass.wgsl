// Grey values less the mean of the 7 x 7 around them: what is left when the eyes are lit or exposed differently.
//
// grey: f32 per pixel, unpadded rows; beyond the image its border is repeated. masked: packed, padded rows. passed: per
// pixel, unpadded rows, the value there and the one to its right, COVERED where masked, as two snorm16 of LEVELS
// (patch_views.wgsl). One invocation per four columns of 16 rows, from the top down: it keeps the
// sums along the last seven rows, so that each grey value is read once.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<storage, read> grey: array<f32>;
@group(0) @binding(2) var<storage, read> masked: array<u32>;
@group(0) @binding(3) var<storage, read_write> passed: array<u32>;

const RADIUS = 3;
const WINDOW = 49.0;
const ROWS = 16;

// Of one row, at columns x .. x + 3 and at x + 4: the grey values and their sums over seven columns.
struct Row {
    grey: vec4<f32>,
    grey_next: f32,
    sums: vec4<f32>,
    sum_next: f32,
}

fn row_at(x: i32, y: i32) -> Row {
    let row = u32(clamp(y, 0, i32(band.height) - 1)) * band.width;
    let end = vec4<i32>(i32(band.width) - 1);
    let zero = vec4<i32>(0);
    let w = vec4<u32>(clamp(vec4<i32>(x - 3, x - 2, x - 1, x), zero, end)) + row;
    let e = vec4<u32>(clamp(vec4<i32>(x + 1, x + 2, x + 3, x + 4), zero, end)) + row;
    let l = vec3<u32>(clamp(vec3<i32>(x + 5, x + 6, x + 7), zero.xyz, end.xyz)) + row;
    let west = vec4<f32>(grey[w.x], grey[w.y], grey[w.z], grey[w.w]);
    let east = vec4<f32>(grey[e.x], grey[e.y], grey[e.z], grey[e.w]);
    let last = vec3<f32>(grey[l.x], grey[l.y], grey[l.z]);
    let middle = west.w + east.x + east.y + east.z;
    let sums = middle + vec4<f32>(west.x + west.y + west.z, west.y + west.z + east.w, west.z + east.w + last.x,
        east.w + last.x + last.y);
    let sum_next = east.x + east.y + east.z + east.w + last.x + last.y + last.z;
    return Row(vec4<f32>(west.w, east.xyz), east.w, sums, sum_next);
}

// Packs columns x .. x + 3 of row y, whose values are `here`, with `next` at x + 4.
fn write(x: u32, y: u32, here: vec4<f32>, next: f32) {
    let words = y * band.words;
    let word = x >> 2u;
    let is_masked = unpack_bytes(masked[words + word]) != vec4<u32>(0u);
    let is_next_masked = (masked[words + min(word + 1u, band.words - 1u)] & 255u) != 0u;
    let own = select(here / LEVELS, vec4<f32>(COVERED), is_masked);
    let beyond = select(next / LEVELS, COVERED, is_next_masked);
    let right = vec4<f32>(own.yzw, beyond);
    for (var lane = 0u; lane < 4u; lane++) {
        if (x + lane < band.width) {
            passed[y * band.width + x + lane] = pack2x16snorm(vec2<f32>(own[lane], right[lane]));
        }
    }
}

@compute @workgroup_size(64)
fn high_pass(@builtin(global_invocation_id) id: vec3<u32>) {
    let first = ROWS * i32(id.y);
    if (id.x >= band.words || first >= i32(band.height)) {
        return;
    }
    let x = 4 * i32(id.x);
    // rows y - 6 .. y - 1
    var r6 = row_at(x, first - 3);
    var r5 = row_at(x, first - 2);
    var r4 = row_at(x, first - 1);
    var r3 = row_at(x, first);
    var r2 = row_at(x, first + 1);
    var r1 = row_at(x, first + 2);
    for (var y = first + RADIUS; y < min(first + ROWS, i32(band.height)) + RADIUS; y++) {
        let r0 = row_at(x, y);
        let sums = r6.sums + r5.sums + r4.sums + r3.sums + r2.sums + r1.sums + r0.sums;
        let sum_next = r6.sum_next + r5.sum_next + r4.sum_next + r3.sum_next + r2.sum_next + r1.sum_next + r0.sum_next;
        write(u32(x), u32(y - RADIUS), r3.grey - sums / WINDOW, r3.grey_next - sum_next / WINDOW);
        r6 = r5;
        r5 = r4;
        r4 = r3;
        r3 = r2;
        r2 = r1;
        r1 = r0;
    }
}
