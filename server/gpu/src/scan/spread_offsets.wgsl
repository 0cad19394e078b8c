// Pass 4 of the prefix sum: each invocation walks its chunk again and writes the offset of each element.

@group(0) @binding(0) var<uniform> count: u32;
@group(0) @binding(1) var<storage, read> flags: array<u32>;
@group(0) @binding(2) var<storage, read> chunks: array<u32>;
@group(0) @binding(3) var<storage, read> blocks: array<u32>;
// number of flags set before the element
@group(0) @binding(4) var<storage, read_write> offsets: array<u32>;

@compute @workgroup_size(64)
fn spread_offsets(@builtin(global_invocation_id) id: vec3<u32>) {
    let start = id.x * 64u;
    if start >= count {
        return;
    }
    var sum = blocks[id.x / 64u] + chunks[id.x];
    for (var i = start; i < min(start + 64u, count); i++) {
        offsets[i] = sum;
        sum += flags[i];
    }
}
