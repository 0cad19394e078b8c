// Copies the kept rows of one array, in order and without gaps. Rows are moved as bits.

@group(0) @binding(0) var<uniform> slots: u32;
@group(0) @binding(1) var<storage, read> kept: array<u32>;
@group(0) @binding(2) var<storage, read> offsets: array<u32>;
@group(0) @binding(3) var<storage, read> rows: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> packed: array<vec4<u32>>;

@compute @workgroup_size(64)
fn pack_rows(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot < slots && kept[slot] != 0u {
        packed[offsets[slot]] = rows[slot];
    }
}
