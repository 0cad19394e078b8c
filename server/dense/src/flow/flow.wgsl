// What the kernels of this folder share; they declare `settings` and `view`.
struct FlowSettings {
    // the grid of patches, and the pixels from one to the next
    columns: u32,
    rows: u32,
    spacing: u32,
    // 0 where the last picture is not what the model shows
    usable: u32,
    // half width of a patch in samples
    radius: i32,
    // steps at each of the three sample distances
    steps: u32,
    // px: largest standard deviation of a match, and largest way from where it was expected
    spread_max_px: f32,
    reach_px: f32,
    // grey levels: largest root mean square of what is left
    misfit_max: f32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

fn inside(at: vec2<i32>) -> bool {
    return all(at >= vec2<i32>(0)) && all(at < vec2<i32>(view.size));
}

fn index_of(at: vec2<i32>) -> u32 {
    return u32(at.y) * view.size.x + u32(at.x);
}

// The pixel in the middle of a patch.
fn patch_centre(number: u32) -> vec2<i32> {
    let cell = vec2<u32>(number % settings.columns, number / settings.columns);
    return vec2<i32>(cell * settings.spacing + settings.spacing / 2u);
}

// Sample distances: from coarse to fine.
const SPREADS: u32 = 3u;

fn spread_of(number: u32) -> i32 {
    return 4 >> number;
}

fn samples_of(radius: i32) -> u32 {
    return u32((2 * radius + 1) * (2 * radius + 1));
}

// A sample lies on the surface of the patch's centre where its depth differs by no more than this share, and what such a
// slope makes of its distance: tissue behind an edge moves by itself.
const STEP_SHARE = 0.03;
const SLOPE_MAX = 1.5;

fn on_surface(centre_depth: f32, depth: f32, offset: vec2<i32>, focal_px: f32) -> bool {
    let way = length(vec2<f32>(offset)) / focal_px;
    return abs(depth - centre_depth) <= centre_depth * (STEP_SHARE + SLOPE_MAX * way);
}
