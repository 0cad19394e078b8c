// What the kernels of this folder are told; `SplatSettings` in mod.rs is the CPU side.

struct SplatSettings {
    slots: u32,
    // cells of the map per pixel along each axis
    scale: u32,
    stable_only: u32,
    // largest half width of a disc, in cells
    reach_max: f32,
    // unstable surfels last seen before this frame are deleted
    forget_before: u32,
    // frames that the model has taken so far
    tick: u32,
}
