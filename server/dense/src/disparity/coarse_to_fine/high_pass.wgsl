// Grey values less the mean of the 7 x 7 around them: what is left when the eyes are lit or exposed differently.
//
// grey, passed: f32 per pixel, unpadded rows; beyond the image its border is repeated. One invocation per four columns
// of 16 rows: it keeps the sums of the ten columns that these need, and moves them down row by row.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<storage, read> grey: array<f32>;
@group(0) @binding(2) var<storage, read_write> passed: array<f32>;

const RADIUS = 3;
const WINDOW = 49.0;
const ROWS = 16;

// Columns x - 3 .. x, x + 1 .. x + 4, x + 5 and x + 6.
struct Columns {
    west: vec4<f32>,
    east: vec4<f32>,
    last: vec2<f32>,
}

fn columns_of(x: i32, y: i32) -> Columns {
    let row = u32(clamp(y, 0, i32(band.height) - 1)) * band.width;
    let end = vec4<i32>(i32(band.width) - 1);
    let zero = vec4<i32>(0);
    let w = vec4<u32>(clamp(vec4<i32>(x - 3, x - 2, x - 1, x), zero, end)) + row;
    let e = vec4<u32>(clamp(vec4<i32>(x + 1, x + 2, x + 3, x + 4), zero, end)) + row;
    let l = vec2<u32>(clamp(vec2<i32>(x + 5, x + 6), zero.xy, end.xy)) + row;
    return Columns(
        vec4<f32>(grey[w.x], grey[w.y], grey[w.z], grey[w.w]),
        vec4<f32>(grey[e.x], grey[e.y], grey[e.z], grey[e.w]),
        vec2<f32>(grey[l.x], grey[l.y]),
    );
}

@compute @workgroup_size(64)
fn high_pass(@builtin(global_invocation_id) id: vec3<u32>) {
    let first = ROWS * i32(id.y);
    if (id.x >= band.words || first >= i32(band.height)) {
        return;
    }
    let x = 4 * i32(id.x);
    var west = vec4<f32>(0.0);
    var east = vec4<f32>(0.0);
    var last = vec2<f32>(0.0);
    for (var y = first - RADIUS; y < first + RADIUS; y++) {
        let row = columns_of(x, y);
        west += row.west;
        east += row.east;
        last += row.last;
    }
    for (var y = first; y < min(first + ROWS, i32(band.height)); y++) {
        let below = columns_of(x, y + RADIUS);
        west += below.west;
        east += below.east;
        last += below.last;
        let middle = west.w + east.x + east.y + east.z;
        let sums = middle + vec4<f32>(west.x + west.y + west.z, west.y + west.z + east.w, west.z + east.w + last.x,
            east.w + last.x + last.y);
        let start = u32(y) * band.width + u32(x);
        for (var lane = 0u; lane < 4u; lane++) {
            if (u32(x) + lane < band.width) {
                passed[start + lane] = grey[start + lane] - sums[lane] / WINDOW;
            }
        }
        let above = columns_of(x, y - RADIUS);
        west -= above.west;
        east -= above.east;
        last -= above.last;
    }
}
