// Descriptors, and images of both views: the left one, then the right one, each in `band.height` rows of
// 4 * `band.words` pixels. The partner of a left pixel of disparity d is d columns to the left, that of a right pixel d
// to the right.

// No energy: neither candidate nor prior.
const NO_MATCH = 0xffffffffu;
// Responses that no image has: masked, or padding.
const SILENT_DESCRIPTOR = vec4<u32>(0u);

fn is_silent(descriptor: vec4<u32>) -> bool {
    return all(descriptor == SILENT_DESCRIPTOR);
}

fn byte_distances(a: u32, b: u32) -> vec4<i32> {
    return abs(vec4<i32>(unpack_bytes(a)) - vec4<i32>(unpack_bytes(b)));
}

// Sum of the absolute differences of the 16 responses.
fn difference(a: vec4<u32>, b: vec4<u32>) -> u32 {
    let sums = byte_distances(a.x, b.x) + byte_distances(a.y, b.y) + byte_distances(a.z, b.z) + byte_distances(a.w, b.w);
    return u32(sums.x + sums.y + sums.z + sums.w);
}

// Sum of the magnitudes of the 16 responses.
fn texture(descriptor: vec4<u32>) -> u32 {
    return difference(descriptor, vec4<u32>(0x80808080u));
}

// Index of a pixel of a view.
fn pixel_index(view: u32, x: u32, y: u32) -> u32 {
    return (view * band.height + y) * 4u * band.words + x;
}

// Columns by which the partner moves with each px of disparity.
fn partner_step(view: u32) -> i32 {
    return select(-1, 1, view == 1u);
}
