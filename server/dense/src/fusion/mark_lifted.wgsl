#import fusion
// Walks the claim table: a place won by a pixel marks that pixel for lifting.

@group(0) @binding(0) var<uniform> settings: FusionSettings;
@group(0) @binding(1) var<storage, read> claims: array<u32>;
// per pixel, zeroed before
@group(0) @binding(2) var<storage, read_write> lifted: array<u32>;

@compute @workgroup_size(64)
fn mark_lifted(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x > settings.table_mask {
        return;
    }
    let claim = claims[id.x];
    if claim != 0u && (claim & 0x80000000u) == 0u {
        lifted[0x7fffffu - (claim & 0x7fffffu)] = 1u;
    }
}
