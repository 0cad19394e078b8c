// Settings of the node graph; `GraphSettings` in dense/src/node_graph/settings.rs is the CPU side. Metres.
// A node is one row of 16 bytes: the bits of its position in world, and its id plus one (0: the slot is free).

struct GraphSettings {
    // surfel slots in use
    surfels: u32,
    // index of the frame in the session, and frames that the model has taken so far
    frame: u32,
    tick: u32,
    // places in the table of buckets and in the table of claims, less one (powers of two)
    bucket_mask: u32,
    claim_mask: u32,
    // a point binds to nodes nearer than this; one cell of the hash is as wide
    reach_m: f32,
    cells_per_metre: f32,
    // distance of nodes
    spacing_m: f32,
    claim_cells_per_metre: f32,
}

const NO_NODE: u32 = 0xffffffffu;

fn is_node(row: vec4<u32>) -> bool {
    return row.w != 0u;
}

fn node_point(row: vec4<u32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(row.xyz);
}

// The bucket that lists the nodes of a cell; cells may share one.
fn node_bucket(cell: vec3<i32>, mask: u32) -> u32 {
    return cell_hash(cell, 0u) & mask;
}
