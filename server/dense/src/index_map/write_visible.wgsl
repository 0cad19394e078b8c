// Packs the slots that list_visible.wgsl found, in order, and sizes the dispatches over them. One invocation per chunk.

@group(0) @binding(0) var<uniform> splat: SplatSettings;
@group(0) @binding(1) var<storage, read> masks: array<u32>;
@group(0) @binding(2) var<storage, read> offsets: array<u32>;
@group(0) @binding(3) var<storage, read> total: array<u32>;
// their number, then the slots
@group(0) @binding(4) var<storage, read_write> visible: array<u32>;
// workgroups of 64 along x, y, z
@group(0) @binding(5) var<storage, read_write> groups: array<u32>;

const CHUNK: u32 = 32u;

@compute @workgroup_size(64)
fn write_visible(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x == 0u {
        // without slots no chunk was counted
        let count = select(0u, total[0], splat.slots > 0u);
        visible[0] = count;
        groups[0] = (count + 63u) / 64u;
        groups[1] = 1u;
        groups[2] = 1u;
    }
    let first = id.x * CHUNK;
    if first >= splat.slots {
        return;
    }
    var place = 1u + offsets[id.x];
    var mask = masks[id.x];
    while mask != 0u {
        visible[place] = first + firstTrailingBit(mask);
        mask &= mask - 1u;
        place += 1u;
    }
}
