#import view
// Index map, pass 2: of the discs whose depth won a cell, the lowest slot (the oldest id) takes it.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> splat: SplatSettings;
@group(0) @binding(2) var<storage, read> visible: array<u32>;
@group(0) @binding(3) var<storage, read> footprints: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> nearest: array<u32>;
// per cell: the inverted slot, 0 where none
@group(0) @binding(5) var<storage, read_write> slots: array<atomic<u32>>;

@compute @workgroup_size(64)
fn splat_slot(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= visible[0] {
        return;
    }
    let slot = visible[1u + id.x];
    let footprint = footprints[id.x];
    if footprint.x == 0u {
        return;
    }
    let first = vec2<u32>(footprint.y & 0xffffu, footprint.y >> 16u);
    let last = vec2<u32>(footprint.z & 0xffffu, footprint.z >> 16u);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let cell = y * view.size.x * splat.scale + x;
            if nearest[cell] == footprint.x {
                atomicMax(&slots[cell], ~slot);
            }
        }
    }
}
