#import surfel
// Marks the slots that survive compaction: those alive, and those whose removal has not been published yet.

@group(0) @binding(0) var<uniform> slots: u32;
@group(0) @binding(1) var<storage, read> history: array<vec4<u32>>;
// third row of the published copy; w is 1 where viewers hold the surfel
@group(0) @binding(2) var<storage, read> published: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> kept: array<u32>;

@compute @workgroup_size(64)
fn mark_kept(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= slots {
        return;
    }
    kept[slot] = select(0u, 1u, is_alive(history[slot].w) || published[slot].w != 0u);
}
