// Descriptor of each pixel of both eyes (Geiger et al. 2010, section 3.1): 16 Sobel responses of its 5 x 5
// neighbourhood, 12 horizontal ones (the centre counts twice) and 4 vertical ones:
//
//     . . h . .
//     h . b . h      h: horizontal, v: vertical, b: both
//     . b 2 b .      2: horizontal, twice
//     h . b . h
//     . . h . .
//
// responses: sobel.wgsl. left_masked, right_masked: four pixels a word. descriptors: both views; padding is silent,
// and so are masked pixels and those two beside one: their responses show the edge of a highlight or of the image's
// black frame. One invocation per word and eye.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<storage, read> responses: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> left_masked: array<u32>;
@group(0) @binding(3) var<storage, read> right_masked: array<u32>;
@group(0) @binding(4) var<storage, read_write> descriptors: array<vec4<u32>>;

// Four pixels and their neighbours to both sides: the horizontal responses, and the vertical ones.
struct Row {
    west_h: vec4<u32>,
    here_h: vec4<u32>,
    east_h: vec4<u32>,
    west_v: vec4<u32>,
    here_v: vec4<u32>,
    east_v: vec4<u32>,
}

fn row_at(eye: u32, word: u32, y: i32) -> Row {
    let start = (eye * band.height + u32(clamp(y, 0, i32(band.height) - 1))) * band.words;
    let here = responses[start + word];
    let h = unpack_bytes(here.x);
    let v = unpack_bytes(here.y);
    var row = Row(h.xxxx, h, h.wwww, v.xxxx, v, v.wwww);
    if (word > 0u) {
        let west = responses[start + word - 1u];
        row.west_h = unpack_bytes(west.x);
        row.west_v = unpack_bytes(west.y);
    }
    if (word + 1u < band.words) {
        let east = responses[start + word + 1u];
        row.east_h = unpack_bytes(east.x);
        row.east_v = unpack_bytes(east.y);
    }
    return row;
}

// The four bytes of a word of each of the four pixels' descriptors.
fn join(a: vec4<u32>, b: vec4<u32>, c: vec4<u32>, d: vec4<u32>) -> vec4<u32> {
    return a | (b << vec4<u32>(8u)) | (c << vec4<u32>(16u)) | (d << vec4<u32>(24u));
}

// Horizontal responses two columns to the west and to the east.
fn two_west(row: Row) -> vec4<u32> {
    return vec4<u32>(row.west_h.zw, row.here_h.xy);
}

fn two_east(row: Row) -> vec4<u32> {
    return vec4<u32>(row.here_h.zw, row.east_h.xy);
}

// Non-zero where masked; nothing is beyond the image.
fn mask_at(eye: u32, word: i32, y: i32) -> vec4<u32> {
    if (word < 0 || word >= i32(band.words) || y < 0 || y >= i32(band.height)) {
        return vec4<u32>(0u);
    }
    let index = u32(y) * band.words + u32(word);
    if (eye == 0u) {
        return unpack_bytes(left_masked[index]);
    }
    return unpack_bytes(right_masked[index]);
}

fn near_mask(eye: u32, word: i32, y: i32) -> vec4<bool> {
    let here = mask_at(eye, word, y);
    let west = vec4<u32>(mask_at(eye, word - 1, y).zw, here.xy);
    let east = vec4<u32>(here.zw, mask_at(eye, word + 1, y).xy);
    return (here | west | east | mask_at(eye, word, y - 2) | mask_at(eye, word, y + 2)) != vec4<u32>(0u);
}

@compute @workgroup_size(64)
fn describe(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let y = i32(id.y);
    let top = row_at(id.z, id.x, y - 2);
    let above = row_at(id.z, id.x, y - 1);
    let level = row_at(id.z, id.x, y);
    let below = row_at(id.z, id.x, y + 1);
    let bottom = row_at(id.z, id.x, y + 2);
    let first = join(top.here_h, two_west(above), above.here_h, two_east(above));
    let west = vec4<u32>(level.west_h.w, level.here_h.xyz);
    let east = vec4<u32>(level.here_h.yzw, level.east_h.x);
    let second = join(west, level.here_h, level.here_h, east);
    let third = join(two_west(below), below.here_h, two_east(below), bottom.here_h);
    let west_v = vec4<u32>(level.west_v.w, level.here_v.xyz);
    let east_v = vec4<u32>(level.here_v.yzw, level.east_v.x);
    let fourth = join(above.here_v, west_v, east_v, below.here_v);
    let columns = vec4<u32>(4u * id.x) + vec4<u32>(0u, 1u, 2u, 3u);
    let silent = near_mask(id.z, i32(id.x), y) | (columns >= vec4<u32>(band.width));
    let index = pixel_index(id.z, 4u * id.x, id.y);
    for (var lane = 0u; lane < 4u; lane++) {
        let descriptor = vec4<u32>(first[lane], second[lane], third[lane], fourth[lane]);
        descriptors[index + lane] = select(descriptor, SILENT_DESCRIPTOR, silent[lane]);
    }
}
