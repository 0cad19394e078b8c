// Pass 1 of the prefix sum: each invocation sums a chunk of 64 flags in a register.

@group(0) @binding(0) var<uniform> count: u32;
// 0 or 1 per element
@group(0) @binding(1) var<storage, read> flags: array<u32>;
// sum per chunk of 64 elements
@group(0) @binding(2) var<storage, read_write> chunks: array<u32>;

@compute @workgroup_size(64)
fn count_chunks(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * 64u;
    if start >= count {
        return;
    }
    var sum = 0u;
    for (var i = start; i < min(start + 64u, count); i++) {
        sum += flags[i];
    }
    chunks[id.x] = sum;
}
