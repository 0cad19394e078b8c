// Support points (section 3.1): candidates on a grid, matched over the whole range by the descriptors at the corners
// of a square, accepted where they have texture, are clearly better than any other place, and are found again from
// the right view.
//
// descriptors: describe.wgsl. support: disparity per candidate in row order, NO_SUPPORT where refused.
// One invocation per candidate.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> search: Search;
@group(0) @binding(2) var<storage, read> descriptors: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> support: array<i32>;

// Half the side of the square, and the columns and rows that its descriptors reach from its centre.
const CORNER = 2u;
const REACH = 5;
const WORST = 0xffffffffu;
const NOWHERE = 0xfffffff0u;

struct Match {
    // index of the disparity with the least cost
    index: u32,
    cost: u32,
    // least cost at an index that is no neighbour of it
    second: u32,
}

fn corners_are_seen(at: u32) -> bool {
    let up = at - CORNER * 4u * band.words;
    let down = at + CORNER * 4u * band.words;
    return !(is_silent(descriptors[up - CORNER]) || is_silent(descriptors[up + CORNER])
        || is_silent(descriptors[down - CORNER]) || is_silent(descriptors[down + CORNER]));
}

// Searches the row `y` of the other view for what is at column `x` of `view`.
fn search_row(view: u32, x: u32, y: u32) -> Match {
    let reach = CORNER * 4u * band.words;
    let at = pixel_index(view, x, y);
    let a = descriptors[at - reach - CORNER];
    let b = descriptors[at - reach + CORNER];
    let c = descriptors[at + reach - CORNER];
    let d = descriptors[at + reach + CORNER];
    let row = pixel_index(1u - view, 0u, y);
    var found = Match(NOWHERE, WORST, WORST);
    var cost = WORST;
    var before = WORST;
    for (var index = 0u; index < 16u * band.groups; index++) {
        let partner = i32(x) + partner_step(view) * (band.min_disparity + i32(index));
        let two_before = before;
        before = cost;
        cost = WORST;
        if (partner >= REACH && partner < i32(band.width) - REACH) {
            let other = row + u32(partner);
            cost = difference(a, descriptors[other - reach - CORNER])
                + difference(b, descriptors[other - reach + CORNER])
                + difference(c, descriptors[other + reach - CORNER])
                + difference(d, descriptors[other + reach + CORNER]);
        }
        let is_next = index == found.index + 1u;
        if (cost < found.cost) {
            // what is left behind is elsewhere, unless it is the neighbour
            found = Match(index, cost, min(found.second, select(found.cost, two_before, is_next)));
        } else if (!is_next) {
            found.second = min(found.second, cost);
        }
    }
    return found;
}

// A match at either end of the range may have its true place beyond it.
fn is_unique(found: Match) -> bool {
    let inside = found.index != 0u && found.index < 16u * band.groups - 1u;
    let compared = found.cost != WORST && found.second != WORST;
    return inside && compared && f32(found.cost) < search.support_threshold * f32(found.second);
}

fn has_texture(at: u32) -> bool {
    let centre = descriptors[at];
    return !is_silent(centre) && texture(centre) >= search.support_texture && corners_are_seen(at);
}

fn support_at(x: u32, y: u32) -> i32 {
    if (!has_texture(pixel_index(0u, x, y))) {
        return NO_SUPPORT;
    }
    let from_left = search_row(0u, x, y);
    if (!is_unique(from_left)) {
        return NO_SUPPORT;
    }
    let disparity = band.min_disparity + i32(from_left.index);
    let partner = u32(i32(x) - disparity);
    if (!has_texture(pixel_index(1u, partner, y))) {
        return NO_SUPPORT;
    }
    let from_right = search_row(1u, partner, y);
    let disagreement = abs(i32(from_right.index) - i32(from_left.index));
    if (!is_unique(from_right) || f32(disagreement) > search.lr_threshold) {
        return NO_SUPPORT;
    }
    return disparity;
}

@compute @workgroup_size(64)
fn match_support(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= search.columns || id.y >= search.rows) {
        return;
    }
    let at = vec2<i32>(i32(id.x * search.step), i32(id.y * search.step));
    let inside = at.x >= REACH && at.x < i32(band.width) - REACH && at.y >= REACH && at.y < i32(band.height) - REACH;
    var disparity = NO_SUPPORT;
    if (inside) {
        disparity = support_at(u32(at.x), u32(at.y));
    }
    support[id.y * search.columns + id.x] = disparity;
}
