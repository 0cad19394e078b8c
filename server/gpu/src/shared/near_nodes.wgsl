// The four nodes nearest to something, in order, and what did not get among them. All in registers: no index that only
// the run knows.

struct NearNodes {
    square_m: vec4<f32>,
    // NO_NODE where there are fewer
    slot: vec4<u32>,
    id: vec4<u32>,
}

struct NearNode {
    square_m: f32,
    slot: u32,
    id: u32,
}

// None yet, of those not farther than the root of `square_m`.
fn no_nodes(square_m: f32) -> NearNodes {
    return NearNodes(vec4<f32>(square_m), vec4<u32>(NO_NODE), vec4<u32>(0u));
}

// Keeps the nearest in order, at equal distance the lower id first; gives back the one that has no place.
fn keep_near(near: ptr<function, NearNodes>, node: NearNode) -> NearNode {
    let held = *near;
    let is_tie = held.square_m == vec4<f32>(node.square_m);
    let moves = (vec4<f32>(node.square_m) < held.square_m) | (is_tie & (vec4<u32>(node.id) < held.id));
    let follows = vec4<bool>(false, moves.xyz);
    let square_m = select(held.square_m, vec4<f32>(node.square_m), moves);
    let slot = select(held.slot, vec4<u32>(node.slot), moves);
    let id = select(held.id, vec4<u32>(node.id), moves);
    (*near).square_m = select(square_m, held.square_m.xxyz, follows);
    (*near).slot = select(slot, held.slot.xxyz, follows);
    (*near).id = select(id, held.id.xxyz, follows);
    if moves.w {
        return NearNode(held.square_m.w, held.slot.w, held.id.w);
    }
    return node;
}
