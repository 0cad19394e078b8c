// Robust plane through the disparities of a 9 x 9 window: smooths along the surface without flattening slants (a plane
// in space is one in disparity), gives the slopes for the normal, and fills small holes inside one surface.
//
// disparities, spreads: padded rows, four pixels an element. planes, unpadded rows: disparity (px), its slopes along
// x and y (px per px), its standard deviation (px); NO_DISPARITY and zeros where unknown.
// Two passes: about the pixel's own disparity (a hole's: its neighbours' mean), then about the first plane; where there
// is a prior, one about its slope.
// One invocation per four pixels, all in the lanes of vec4.

struct PlaneFit {
    // px: gates of the two passes
    first_gate: f32,
    second_gate: f32,
    // px: about the mean around a hole, for it to be filled
    hole_gate: f32,
    // px: a result farther from the pixel's own disparity is refused
    shift_max: f32,
    // share of the window that must be known for a hole to be filled
    fill_share_min: f32,
    // standard deviation: floor, and factors of the residual and of the share of the window off the plane
    sigma_floor: f32,
    residual_factor: f32,
    missing_factor: f32,
    // 1: `planes` hold a prior, whose slopes stand in for the first pass
    has_prior: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> fit: PlaneFit;
@group(0) @binding(2) var<storage, read> disparities: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> spreads: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> masked: array<u32>;
@group(0) @binding(5) var<storage, read_write> planes: array<vec4<f32>>;

const WINDOW = 81.0;
const INLIERS_MIN = 6.0;

struct Plane {
    value: vec4<f32>,
    slope_x: vec4<f32>,
    slope_y: vec4<f32>,
}

struct Span {
    west: vec4<f32>,
    here: vec4<f32>,
    east: vec4<f32>,
}

struct Sums {
    n: vec4<f32>,
    x: vec4<f32>,
    y: vec4<f32>,
    xx: vec4<f32>,
    xy: vec4<f32>,
    yy: vec4<f32>,
    d: vec4<f32>,
    xd: vec4<f32>,
    yd: vec4<f32>,
    dd: vec4<f32>,
}

fn span_at(word: u32, y: i32) -> Span {
    let none = vec4<f32>(NO_DISPARITY);
    if (y < 0 || y >= i32(band.height)) {
        return Span(none, none, none);
    }
    let index = u32(y) * band.words + word;
    var span = Span(none, disparities[index], none);
    if (word > 0u) {
        span.west = disparities[index - 1u];
    }
    if (word + 1u < band.words) {
        span.east = disparities[index + 1u];
    }
    return span;
}

// Sums along a row of the window.
struct RowSums {
    n: vec4<f32>,
    x: vec4<f32>,
    xx: vec4<f32>,
    d: vec4<f32>,
    xd: vec4<f32>,
    dd: vec4<f32>,
}

// Adds the neighbours `x` columns on that lie within `gate` of the plane; disparities count from the plane's value at
// the centre, as `plane_here`, its value in this row, does.
fn add(sums: ptr<function, RowSums>, plane_here: vec4<f32>, plane: Plane, gate: f32, x: f32, values: vec4<f32>) {
    let off = values - plane.value;
    let inside = abs(off - (plane_here + plane.slope_x * x)) <= vec4<f32>(gate);
    let weight = select(vec4<f32>(0.0), vec4<f32>(1.0), inside);
    let value = select(vec4<f32>(0.0), off, inside);
    (*sums).n += weight;
    (*sums).x += weight * x;
    (*sums).xx += weight * (x * x);
    (*sums).d += value;
    (*sums).xd += value * x;
    (*sums).dd += value * value;
}

fn gather(word: u32, y: i32, plane: Plane, gate: f32) -> Sums {
    let zero = vec4<f32>(0.0);
    var sums = Sums(zero, zero, zero, zero, zero, zero, zero, zero, zero, zero);
    for (var dy = -4; dy <= 4; dy++) {
        let s = span_at(word, y + dy);
        let v = f32(dy);
        let here = plane.slope_y * v;
        var row = RowSums(zero, zero, zero, zero, zero, zero);
        add(&row, here, plane, gate, -4.0, s.west);
        add(&row, here, plane, gate, -3.0, vec4<f32>(s.west.yzw, s.here.x));
        add(&row, here, plane, gate, -2.0, vec4<f32>(s.west.zw, s.here.xy));
        add(&row, here, plane, gate, -1.0, vec4<f32>(s.west.w, s.here.xyz));
        add(&row, here, plane, gate, 0.0, s.here);
        add(&row, here, plane, gate, 1.0, vec4<f32>(s.here.yzw, s.east.x));
        add(&row, here, plane, gate, 2.0, vec4<f32>(s.here.zw, s.east.xy));
        add(&row, here, plane, gate, 3.0, vec4<f32>(s.here.w, s.east.xyz));
        add(&row, here, plane, gate, 4.0, s.east);
        sums.n += row.n;
        sums.x += row.x;
        sums.y += v * row.n;
        sums.xx += row.xx;
        sums.xy += v * row.x;
        sums.yy += (v * v) * row.n;
        sums.d += row.d;
        sums.xd += row.xd;
        sums.yd += v * row.d;
        sums.dd += row.dd;
    }
    return sums;
}

// Least squares through disparities that count from `origin`; where the inliers do not span a plane, `n` is set to zero.
fn solve(sums: ptr<function, Sums>, origin: vec4<f32>) -> Plane {
    let n = max((*sums).n, vec4<f32>(1.0));
    let xx = (*sums).xx - (*sums).x * (*sums).x / n;
    let xy = (*sums).xy - (*sums).x * (*sums).y / n;
    let yy = (*sums).yy - (*sums).y * (*sums).y / n;
    let xd = (*sums).xd - (*sums).x * (*sums).d / n;
    let yd = (*sums).yd - (*sums).y * (*sums).d / n;
    let determinant = xx * yy - xy * xy;
    let solvable = ((*sums).n >= vec4<f32>(INLIERS_MIN)) & (determinant > 0.001 * n * n);
    let safe = select(vec4<f32>(1.0), determinant, solvable);
    let slope_x = (yy * xd - xy * yd) / safe;
    let slope_y = (xx * yd - xy * xd) / safe;
    (*sums).n = select(vec4<f32>(0.0), (*sums).n, solvable);
    let offset = ((*sums).d - slope_x * (*sums).x - slope_y * (*sums).y) / n;
    return Plane(origin + offset, slope_x, slope_y);
}

// Root mean square residual of the inliers about their plane.
fn residual_rms(sums: Sums, plane: Plane) -> vec4<f32> {
    let n = max(sums.n, vec4<f32>(1.0));
    let xd = sums.xd - sums.x * sums.d / n;
    let yd = sums.yd - sums.y * sums.d / n;
    let squares = sums.dd - sums.d * sums.d / n - plane.slope_x * xd - plane.slope_y * yd;
    return sqrt(max(squares, vec4<f32>(0.0)) / n);
}

// Mean of the known neighbours where enough of them are known and all close to it, else NO_DISPARITY.
fn hole_values(word: u32, y: i32) -> vec4<f32> {
    let far = vec4<f32>(0.0);
    let anything = Plane(far, far, far);
    let sums = gather(word, y, anything, 1.0e5);
    let n = max(sums.n, vec4<f32>(1.0));
    let mean = sums.d / n;
    let inside = gather(word, y, Plane(mean, far, far), fit.hole_gate);
    let fillable = (sums.n >= vec4<f32>(fit.fill_share_min * WINDOW)) & (inside.n == sums.n);
    return select(vec4<f32>(NO_DISPARITY), mean, fillable);
}

fn slopes_at(id: vec3<u32>, lane: u32) -> vec2<f32> {
    return planes[id.y * band.width + min(4u * id.x + lane, band.width - 1u)].yz;
}

// Through the pixels' own disparities.
fn prior_plane(id: vec3<u32>, origin: vec4<f32>) -> Plane {
    let a = slopes_at(id, 0u);
    let b = slopes_at(id, 1u);
    let c = slopes_at(id, 2u);
    let d = slopes_at(id, 3u);
    return Plane(origin, vec4<f32>(a.x, b.x, c.x, d.x), vec4<f32>(a.y, b.y, c.y, d.y));
}

@compute @workgroup_size(64)
fn fit_plane(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let y = i32(id.y);
    let index = id.y * band.words + id.x;
    let none = vec4<f32>(NO_DISPARITY);
    let own = disparities[index];
    let hole = (own == none) & (unpack_bytes(masked[index]) == vec4<u32>(0u));
    var origin = own;
    if (any(hole)) {
        origin = select(own, hole_values(id.x, y), hole);
    }
    let flat = vec4<f32>(0.0);
    var first_plane = Plane(origin, flat, flat);
    var is_plane = origin != none;
    if (fit.has_prior != 0u) {
        first_plane = prior_plane(id, origin);
    } else {
        var first = gather(id.x, y, first_plane, fit.first_gate);
        first_plane = solve(&first, origin);
        is_plane = is_plane & (first.n > flat);
    }
    var sums = gather(id.x, y, first_plane, fit.second_gate);
    let plane = solve(&sums, first_plane.value);
    let residual = residual_rms(sums, plane);
    let stays = hole | (abs(plane.value - own) <= vec4<f32>(fit.shift_max));
    let good = is_plane & (sums.n > flat) & stays;
    // the match itself says nothing in a hole, where the residual must do
    let spread = select(spreads[index], residual, hole);
    let missing = 1.0 - sums.n / WINDOW;
    let variance = fit.sigma_floor * fit.sigma_floor
        + fit.residual_factor * fit.residual_factor * residual * residual
        + spread * spread
        + fit.missing_factor * fit.missing_factor * missing * missing;
    let sigma = sqrt(variance);
    let target_index = id.y * band.width + 4u * id.x;
    for (var lane = 0u; lane < 4u; lane++) {
        if (4u * id.x + lane < band.width) {
            let result = vec4<f32>(plane.value[lane], plane.slope_x[lane], plane.slope_y[lane], sigma[lane]);
            let nothing = vec4<f32>(NO_DISPARITY, 0.0, 0.0, 0.0);
            planes[target_index + lane] = select(nothing, result, good[lane]);
        }
    }
}
