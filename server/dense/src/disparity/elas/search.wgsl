// The parameters of ELAS; `Search` in search.rs is the CPU side.

struct Search {
    // support points: spacing of the candidates (px), and their number along x and y
    step: u32,
    columns: u32,
    rows: u32,
    // cells of the grid of candidate disparities: side (px), number along x and y, words of a cell's bit set
    cell: u32,
    cell_columns: u32,
    cell_rows: u32,
    mask_words: u32,
    // least sum of the responses' magnitudes
    support_texture: u32,
    match_texture: u32,
    // largest cost of a support point in terms of the second best
    support_threshold: f32,
    // largest disagreement of the two views, px
    lr_threshold: f32,
    // consistency: half the window (candidates), largest difference (px), fewest agreeing points
    incon_window: i32,
    incon_threshold: i32,
    incon_min_support: u32,
    // redundancy: reach (candidates), largest difference (px)
    redun_max_dist: i32,
    redun_threshold: i32,
    // disparities searched to each side of the prior
    radius: i32,
    // standard deviation of a match whose costs rise by 1 to both sides together, px
    rise_sigma: f32,
    // 1: a pixel without any candidate in its grid cell is matched about its plane alone
    prior_alone: u32,
    padding: u32,
    // what the prior takes off the energy, by the distance from its disparity; in quarters of a difference
    bonus: array<vec4<u32>, 4>,
}

// No support point at this candidate.
const NO_SUPPORT = -32768;
