#import surfel
#import graph
// Growth, pass 2: of two winners nearer than 0.7 spacings only the lower slot becomes a node; the other may claim again
// in the next frame, if the new node does not cover it.

@group(0) @binding(0) var<uniform> graph: GraphSettings;
@group(0) @binding(1) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> claims: array<u32>;
// per place: the chosen surfel's slot plus one, 0 where none
@group(0) @binding(3) var<storage, read_write> chosen: array<u32>;

const APART: f32 = 0.7;

@compute @workgroup_size(64)
fn thin_nodes(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = id.x;
    if place > graph.claim_mask {
        return;
    }
    let claim = claims[place];
    chosen[place] = select(0u, ~claim + 1u, claim != 0u && !is_crowded(claim));
}

fn is_crowded(claim: u32) -> bool {
    let point = geometry[~claim].xyz;
    let home = cell_of(point, graph.claim_cells_per_metre);
    for (var around = 0; around < 27; around++) {
        let cell = home + vec3<i32>(around % 3, around / 3 % 3, around / 9) - 1;
        let other = claims[cell_hash(cell, graph.tick) & graph.claim_mask];
        if other > claim && distance(geometry[~other].xyz, point) < APART * graph.spacing_m {
            return true;
        }
    }
    return false;
}
