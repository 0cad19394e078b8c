// The nodes nearest to something, in order. Whoever imports this declares `NEAREST`, how many are kept.

struct NearNodes {
    square_m: array<f32, NEAREST>,
    slot: array<u32, NEAREST>,
    id: array<u32, NEAREST>,
}

// Keeps the nearest in order; at equal distance the lower id comes first.
fn keep_near(near: ptr<function, NearNodes>, square_m: f32, slot: u32, id: u32) {
    var square = square_m;
    var key = vec2<u32>(slot, id);
    for (var i = 0u; i < NEAREST; i++) {
        let held = (*near).square_m[i];
        let held_key = vec2<u32>((*near).slot[i], (*near).id[i]);
        if square < held || (square == held && key.y < held_key.y) {
            (*near).square_m[i] = square;
            (*near).slot[i] = key.x;
            (*near).id[i] = key.y;
            square = held;
            key = held_key;
        }
    }
}
