// What the kernels of the surfel model share. Per slot, four rows of 16 bytes:
//   geometry     position in world (m), radius (m)
//   orientation  unit normal in world, weight
//   appearance   red, green, blue (0-255), colour weight
//   history      id, frame last seen, frame created, state bits

const ALIVE: u32 = 1u;
const STABLE: u32 = 2u;

fn is_alive(state: u32) -> bool {
    return (state & ALIVE) != 0u;
}

fn is_stable(state: u32) -> bool {
    return (state & (ALIVE | STABLE)) == (ALIVE | STABLE);
}

// The cell of the point grid that holds a point.
fn cell_of(point: vec3<f32>, cells_per_metre: f32) -> vec3<i32> {
    return vec3<i32>(floor(point * cells_per_metre));
}

// Where a cell claims its place in the table. Two cells may share a place: then one of them waits for a frame with
// another seed.
fn cell_hash(cell: vec3<i32>, seed: u32) -> u32 {
    let c = bitcast<vec3<u32>>(cell);
    var h = seed;
    h = (h ^ c.x) * 0x85ebca6bu;
    h = (h ^ (h >> 15u) ^ c.y) * 0xc2b2ae35u;
    h = (h ^ (h >> 13u) ^ c.z) * 0x27d4eb2fu;
    return h ^ (h >> 16u);
}
