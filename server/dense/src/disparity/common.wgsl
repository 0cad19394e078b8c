// What all disparity kernels share; `Band` in band.rs is the CPU side.

struct Band {
    // the whole image
    width: u32,
    height: u32,
    // words of four pixels per row: rows are padded to a multiple of four pixels
    words: u32,
    // disparity of index 0, a multiple of four
    min_disparity: i32,
    // rows of the image whose costs this band holds, and those of them whose result is kept
    first_row: u32,
    rows: u32,
    keep_first: u32,
    keep_rows: u32,
    // groups of 16 disparities
    groups: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

// Where a disparity image says nothing.
const NO_DISPARITY = -1.0e6;
// Census bit 31: masked or outside the image, matches everything equally well.
const SILENT = 0x80000000u;

fn known(disparity: f32) -> bool {
    return disparity > -1.0e5;
}

fn unpack_bytes(word: u32) -> vec4<u32> {
    return (vec4<u32>(word) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(255u);
}

fn pack_bytes(bytes: vec4<u32>) -> u32 {
    return bytes.x | (bytes.y << 8u) | (bytes.z << 16u) | (bytes.w << 24u);
}
