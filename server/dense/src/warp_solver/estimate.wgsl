// Reading an estimate. A kernel that imports this declares `nodes` and `estimates` (two halves of three rows per node slot).

fn estimate_row(half: u32, slot: u32, row: u32) -> vec4<f32> {
    return estimates[3u * (half * arrayLength(&nodes) + slot) + row];
}
