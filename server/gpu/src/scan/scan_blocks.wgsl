// Pass 3 of the prefix sum: one invocation turns the few block sums into offsets and leaves the total.

@group(0) @binding(0) var<uniform> count: u32;
@group(0) @binding(1) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(2) var<storage, read_write> total: array<u32>;

@compute @workgroup_size(1)
fn scan_blocks() {
    let block_count = (count + 4095u) / 4096u;
    var sum = 0u;
    for (var i = 0u; i < block_count; i++) {
        let own = blocks[i];
        blocks[i] = sum;
        sum += own;
    }
    total[0] = sum;
}
