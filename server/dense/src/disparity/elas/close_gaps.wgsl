// Gaps of few unknown pixels along a row or a column are closed between the known pixels at their ends: by their mean
// where both lie on one surface, else by the farther of them. Masked pixels stay unknown.
//
// disparities, filled: padded rows, four pixels an element. spreads, changed in place at closed pixels: the wider of
// the ends', widened by half their difference. One invocation per four pixels.

struct Gaps {
    // pixels of the longest gap
    width_max: u32,
    // 0: along rows, 1: along columns
    along_columns: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> gaps: Gaps;
@group(0) @binding(2) var<storage, read> masked: array<u32>;
@group(0) @binding(3) var<storage, read> disparities: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> filled: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> spreads: array<vec4<f32>>;

// px: the ends of a gap that differ by more lie on different surfaces
const SAME_SURFACE = 3.0;

// Pixels from (x, y) to the first known one, `gaps.width_max` + 1 where there is none so near.
fn distance_to_known(x: i32, y: i32, direction: i32) -> i32 {
    let step = select(vec2<i32>(direction, 0), vec2<i32>(0, direction), gaps.along_columns == 1u);
    var at = vec2<i32>(x, y);
    for (var distance = 1; distance <= i32(gaps.width_max); distance++) {
        at += step;
        if (at.x < 0 || at.x >= i32(band.width) || at.y < 0 || at.y >= i32(band.height)) {
            break;
        }
        if (known(disparities[u32(at.y) * band.words + (u32(at.x) >> 2u)][u32(at.x) & 3u])) {
            return distance;
        }
    }
    return i32(gaps.width_max) + 1;
}

// Disparity and spread of an unknown pixel.
fn closed(x: i32, y: i32) -> vec2<f32> {
    let before = distance_to_known(x, y, -1);
    let after = distance_to_known(x, y, 1);
    if (before + after - 1 > i32(gaps.width_max)) {
        return vec2<f32>(NO_DISPARITY, 0.0);
    }
    let unit = select(vec2<i32>(1, 0), vec2<i32>(0, 1), gaps.along_columns == 1u);
    let p = vec2<i32>(x, y) - before * unit;
    let q = vec2<i32>(x, y) + after * unit;
    let p_word = u32(p.y) * band.words + (u32(p.x) >> 2u);
    let q_word = u32(q.y) * band.words + (u32(q.x) >> 2u);
    let a = disparities[p_word][u32(p.x) & 3u];
    let b = disparities[q_word][u32(q.x) & 3u];
    let spread = max(spreads[p_word][u32(p.x) & 3u], spreads[q_word][u32(q.x) & 3u]) + 0.5 * abs(a - b);
    return vec2<f32>(select(min(a, b), 0.5 * (a + b), abs(a - b) < SAME_SURFACE), spread);
}

@compute @workgroup_size(64)
fn close_gaps(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let index = id.y * band.words + id.x;
    let covered = unpack_bytes(masked[index]) != vec4<u32>(0u);
    var disparity = disparities[index];
    var spread = spreads[index];
    for (var lane = 0u; lane < 4u; lane++) {
        let x = 4u * id.x + lane;
        if (!known(disparity[lane]) && !covered[lane] && x < band.width) {
            let result = closed(i32(x), i32(id.y));
            disparity[lane] = result.x;
            spread[lane] = result.y;
        }
    }
    filled[index] = disparity;
    spreads[index] = spread;
}
