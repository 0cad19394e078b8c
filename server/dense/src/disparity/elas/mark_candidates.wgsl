// The disparities that a pixel may have apart from its prior (section 3.2): those of the support points in its grid
// cell and the eight around it, and their neighbours, as a bit set per cell of both views.
//
// plausible: disparity per candidate in row order. candidates: per view and cell `mask_words` words, bit k of them for
// `min_disparity + k`. One invocation per word of a cell.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> search: Search;
@group(0) @binding(2) var<storage, read> plausible: array<i32>;
@group(0) @binding(3) var<storage, read_write> candidates: array<u32>;

// Bit of disparity index `k` in the word of the 32 indices from `first` on.
fn bit_of(k: i32, first: i32) -> u32 {
    if (k < first || k >= first + 32) {
        return 0u;
    }
    return 1u << u32(k - first);
}

// The candidates, from the first to behind the last, whose pixels lie at `low` to before `high`.
fn candidate_range(low: i32, high: i32, count: u32) -> vec2<i32> {
    let step = i32(search.step);
    let first = (max(low, 0) + step - 1) / step;
    let end = (max(high, 0) + step - 1) / step;
    return min(vec2<i32>(first, end), vec2<i32>(i32(count)));
}

@compute @workgroup_size(64)
fn mark_candidates(@builtin(global_invocation_id) id: vec3<u32>) {
    let cells = search.cell_columns * search.cell_rows;
    let cell = id.x / search.mask_words;
    if (cell >= cells || id.y > 1u) {
        return;
    }
    let word = id.x % search.mask_words;
    let first_index = i32(32u * word);
    let last_index = i32(16u * band.groups) - 1;
    let side = i32(search.cell);
    let low = (vec2<i32>(i32(cell % search.cell_columns), i32(cell / search.cell_columns)) - 1) * side;
    let high = low + 3 * side;
    // a support point is d columns farther left in the right view
    let shift = select(vec2<i32>(0), vec2<i32>(0, last_index) + band.min_disparity, id.y == 1u);
    let columns = candidate_range(low.x + shift.x, high.x + shift.y, search.columns);
    let rows = candidate_range(low.y, high.y, search.rows);
    var bits = 0u;
    for (var row = rows.x; row < rows.y; row++) {
        for (var column = columns.x; column < columns.y; column++) {
            let disparity = plausible[u32(row) * search.columns + u32(column)];
            let x = column * i32(search.step) - select(0, disparity, id.y == 1u);
            if (disparity != NO_SUPPORT && x >= low.x && x < high.x) {
                let k = disparity - band.min_disparity;
                bits |= bit_of(max(k - 1, 0), first_index) | bit_of(k, first_index)
                    | bit_of(min(k + 1, last_index), first_index);
            }
        }
    }
    candidates[(id.y * cells + cell) * search.mask_words + word] = bits;
}
