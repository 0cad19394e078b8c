// Which triangle each pixel of a view lies in. A pixel on an edge belongs to the one of its two triangles whose edge
// runs down the image, or level to the left: so each pixel is written once, in whatever order.
//
// strips: triangle (index | view << 31), first row, rows, padding: a triangle cut into pieces of few rows.
// corners: per triangle x0 y0 x1 y1, then x2 y2, on integer pixels, its inside to the right of each edge as seen
// on the screen. triangle_of: 1 + index of the triangle, both views; zeroed before. One invocation per strip.

struct StripCount {
    count: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> strip_count: StripCount;
@group(0) @binding(2) var<storage, read> strips: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> corners: array<vec4<i32>>;
@group(0) @binding(4) var<storage, read_write> triangle_of: array<u32>;

fn floor_divide(a: i32, b: i32) -> i32 {
    let quotient = a / b;
    return select(quotient, quotient - 1, quotient * b != a && ((a < 0) != (b < 0)));
}

// The columns, first and last, of `columns` on row `y` that lie to the right of the edge from `from` to `to`.
fn clip(columns: vec2<i32>, y: i32, start: vec2<i32>, end: vec2<i32>) -> vec2<i32> {
    let edge = end - start;
    let is_own = edge.y > 0 || (edge.y == 0 && edge.x < 0);
    // inside: edge.x * (y - start.y) - edge.y * (x - start.x) >= (is_own ? 0 : 1)
    let least = select(1, 0, is_own) - edge.x * (y - start.y) - edge.y * start.x;
    if (edge.y < 0) {
        return vec2<i32>(max(columns.x, -floor_divide(-least, -edge.y)), columns.y);
    }
    if (edge.y > 0) {
        return vec2<i32>(columns.x, min(columns.y, floor_divide(-least, edge.y)));
    }
    return select(columns, vec2<i32>(0, -1), least > 0);
}

@compute @workgroup_size(64)
fn fill_triangles(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= strip_count.count) {
        return;
    }
    let strip = strips[id.x];
    let triangle = strip.x & 0x7fffffffu;
    let view = strip.x >> 31u;
    let ab = corners[2u * triangle];
    let c = corners[2u * triangle + 1u].xy;
    for (var row = strip.y; row < strip.y + strip.z; row++) {
        let y = i32(row);
        var columns = vec2<i32>(0, i32(band.width) - 1);
        columns = clip(columns, y, ab.xy, ab.zw);
        columns = clip(columns, y, ab.zw, c);
        columns = clip(columns, y, c, ab.xy);
        for (var x = columns.x; x <= columns.y; x++) {
            triangle_of[pixel_index(view, u32(x), row)] = triangle + 1u;
        }
    }
}
