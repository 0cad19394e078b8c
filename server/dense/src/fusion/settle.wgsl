#import surfel
#import fusion
// Step 4 of Algorithm 2 and Algorithm 3 for the surfels in view: stability, and the deletion of those that lost their weight
// and of all but one in a cell of the point grid. Counts the changes; the list of visible surfels deletes forgotten ones.

@group(0) @binding(0) var<uniform> settings: FusionSettings;
@group(0) @binding(1) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> claims: array<u32>;
@group(0) @binding(4) var<storage, read_write> history: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> results: array<atomic<u32>>;
// number and slots of the surfels in view
@group(0) @binding(6) var<storage, read> visible: array<u32>;

// Whether a better surfel of the same cell that faces the same way holds this one's cell.
fn is_redundant(slot: u32) -> bool {
    let cells_per_metre = 1.0 / settings.spacing_m;
    let cell = cell_of(geometry[slot].xyz, cells_per_metre);
    let claim = claims[cell_hash(cell, settings.seed) & settings.table_mask];
    let winner = 0xffffffu - (claim & 0xffffffu);
    if (claim & 0x80000000u) == 0u || winner == slot {
        return false;
    }
    let same_cell = all(cell_of(geometry[winner].xyz, cells_per_metre) == cell);
    return same_cell && dot(orientation[winner].xyz, orientation[slot].xyz) > 0.0;
}

@compute @workgroup_size(64)
fn settle(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= visible[0] || atomicLoad(&results[ACCEPTED]) == 0u {
        return;
    }
    let slot = visible[1u + id.x];
    let past = history[slot];
    let weight = orientation[slot].w;
    var state = past.w;
    if weight >= settings.weight_stable {
        state |= STABLE;
    } else if weight < 0.5 * settings.weight_stable {
        state &= ~STABLE;
    }
    if weight <= 0.0 || (past.y == settings.frame && is_redundant(slot)) {
        state = 0u;
    }
    if state == past.w {
        return;
    }
    history[slot].w = state;
    if !is_alive(state) {
        atomicAdd(&results[DIED], 1u);
    }
    if is_stable(state) {
        atomicAdd(&results[BECAME_STABLE], 1u);
    } else if is_stable(past.w) {
        atomicAdd(&results[LOST_STABILITY], 1u);
    }
}
