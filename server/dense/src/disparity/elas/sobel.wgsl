// Horizontal and vertical 3 x 3 Sobel responses of both eyes, 128 added, cut off at what a byte holds. (Published: a
// quarter of them. Tissue has weak gradients, of which that keeps little.)
//
// left, right: grey values, four pixels a word, padded rows. responses: per word of four pixels the horizontal ones,
// then the vertical ones; the left eye, then the right one. Beyond the image its border is repeated.
// One invocation per word and eye.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<storage, read> left: array<u32>;
@group(0) @binding(2) var<storage, read> right: array<u32>;
@group(0) @binding(3) var<storage, read_write> responses: array<vec2<u32>>;

// Four pixels, and those one to the west and one to the east of them.
struct Row {
    west: vec4<i32>,
    here: vec4<i32>,
    east: vec4<i32>,
}

fn grey_values(eye: u32, index: u32) -> vec4<i32> {
    if (eye == 0u) {
        return vec4<i32>(unpack_bytes(left[index]));
    }
    return vec4<i32>(unpack_bytes(right[index]));
}

fn row_at(eye: u32, word: u32, y: i32) -> Row {
    let start = u32(clamp(y, 0, i32(band.height) - 1)) * band.words;
    let here = grey_values(eye, start + word);
    var before = here.x;
    var after = here.w;
    if (word > 0u) {
        before = grey_values(eye, start + word - 1u).w;
    }
    if (word + 1u < band.words) {
        after = grey_values(eye, start + word + 1u).x;
    }
    return Row(vec4<i32>(before, here.xyz), here, vec4<i32>(here.yzw, after));
}

fn pack_responses(sums: vec4<i32>) -> u32 {
    return pack_bytes(vec4<u32>(clamp(sums + 128, vec4<i32>(0), vec4<i32>(255))));
}

@compute @workgroup_size(64)
fn sobel(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let above = row_at(id.z, id.x, i32(id.y) - 1);
    let level = row_at(id.z, id.x, i32(id.y));
    let below = row_at(id.z, id.x, i32(id.y) + 1);
    let along_x = (above.east - above.west) + 2 * (level.east - level.west) + (below.east - below.west);
    let along_y = (below.west + 2 * below.here + below.east) - (above.west + 2 * above.here + above.east);
    let index = (id.z * band.height + id.y) * band.words + id.x;
    responses[index] = vec2<u32>(pack_responses(along_x), pack_responses(along_y));
}
