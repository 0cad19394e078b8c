// Pass 2 of the prefix sum: each invocation turns 64 chunk sums into offsets within their block and leaves the block's sum.

@group(0) @binding(0) var<uniform> count: u32;
@group(0) @binding(1) var<storage, read_write> chunks: array<u32>;
// sum per block of 64 chunks (4,096 elements)
@group(0) @binding(2) var<storage, read_write> blocks: array<u32>;

@compute @workgroup_size(64)
fn scan_chunks(@builtin(global_invocation_id) id: vec3<u32>) {
    let chunk_count = (count + 63u) / 64u;
    let start = id.x * 64u;
    if start >= chunk_count {
        return;
    }
    var sum = 0u;
    for (var i = start; i < min(start + 64u, chunk_count); i++) {
        let own = chunks[i];
        chunks[i] = sum;
        sum += own;
    }
    blocks[id.x] = sum;
}
