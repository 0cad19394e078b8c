// Median of 3 x 3. A pixel keeps its value where few neighbours are known, and loses it where almost none is.
//
// source, filtered: disparity images in padded rows, four pixels an element, NO_DISPARITY where unknown.
// One invocation per four pixels.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<storage, read> source: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> filtered: array<vec4<f32>>;

const UNKNOWN_LAST = 1.0e6;

fn at(word: i32, y: i32) -> vec4<f32> {
    if (word < 0 || word >= i32(band.words) || y < 0 || y >= i32(band.height)) {
        return vec4<f32>(NO_DISPARITY);
    }
    return source[u32(y) * band.words + u32(word)];
}

fn order(values: ptr<function, array<vec4<f32>, 9>>, i: u32, j: u32) {
    let low = min((*values)[i], (*values)[j]);
    (*values)[j] = max((*values)[i], (*values)[j]);
    (*values)[i] = low;
}

fn sort(values: ptr<function, array<vec4<f32>, 9>>) {
    order(values, 0u, 3u); order(values, 1u, 7u); order(values, 2u, 5u); order(values, 4u, 8u);
    order(values, 0u, 7u); order(values, 2u, 4u); order(values, 3u, 8u); order(values, 5u, 6u);
    order(values, 0u, 2u); order(values, 1u, 3u); order(values, 4u, 5u); order(values, 7u, 8u);
    order(values, 1u, 4u); order(values, 3u, 6u); order(values, 5u, 7u);
    order(values, 0u, 1u); order(values, 2u, 4u); order(values, 3u, 5u); order(values, 6u, 8u);
    order(values, 2u, 3u); order(values, 4u, 5u); order(values, 6u, 7u);
    order(values, 1u, 2u); order(values, 3u, 4u); order(values, 5u, 6u);
}

@compute @workgroup_size(64)
fn median(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let word = i32(id.x);
    var values: array<vec4<f32>, 9>;
    var count = vec4<f32>(0.0);
    let centre = at(word, i32(id.y));
    let none = vec4<f32>(NO_DISPARITY);
    let top = at(word, i32(id.y) - 1);
    let bottom = at(word, i32(id.y) + 1);
    values[0] = vec4<f32>(at(word - 1, i32(id.y) - 1).w, top.xyz);
    values[1] = top;
    values[2] = vec4<f32>(top.yzw, at(word + 1, i32(id.y) - 1).x);
    values[3] = vec4<f32>(at(word - 1, i32(id.y)).w, centre.xyz);
    values[4] = centre;
    values[5] = vec4<f32>(centre.yzw, at(word + 1, i32(id.y)).x);
    values[6] = vec4<f32>(at(word - 1, i32(id.y) + 1).w, bottom.xyz);
    values[7] = bottom;
    values[8] = vec4<f32>(bottom.yzw, at(word + 1, i32(id.y) + 1).x);
    for (var i = 0u; i < 9u; i++) {
        count += select(vec4<f32>(0.0), vec4<f32>(1.0), values[i] != none);
        values[i] = select(values[i], vec4<f32>(UNKNOWN_LAST), values[i] == none);
    }
    sort(&values);
    let middle = select(select(values[2], values[3], count >= vec4<f32>(6.0)), values[4], count >= vec4<f32>(8.0));
    let kept = select(select(middle, centre, count < vec4<f32>(5.0)), none, count < vec4<f32>(3.0));
    filtered[id.y * band.words + id.x] = select(kept, none, centre == none);
}
