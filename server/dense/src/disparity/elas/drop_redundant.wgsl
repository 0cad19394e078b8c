// Support points that a neighbour to each side on their line says as well are dropped, first along columns, then
// along rows. Each line is walked in order, so that of a row of equal points some stay.
//
// plausible: drop_implausible.wgsl, changed in place. One invocation per line.

struct Lines {
    // candidates from one point to the next on a line, and from one line to the next
    along: u32,
    across: u32,
    length: u32,
    count: u32,
}

@group(0) @binding(0) var<uniform> search: Search;
@group(0) @binding(1) var<uniform> lines: Lines;
@group(0) @binding(2) var<storage, read_write> plausible: array<i32>;

fn says_the_same(line: u32, place: i32, own: i32) -> bool {
    if (place < 0 || place >= i32(lines.length)) {
        return false;
    }
    let other = plausible[line * lines.across + u32(place) * lines.along];
    return other != NO_SUPPORT && abs(other - own) <= search.redun_threshold;
}

@compute @workgroup_size(64)
fn drop_redundant(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= lines.count) {
        return;
    }
    for (var place = 0; place < i32(lines.length); place++) {
        let index = id.x * lines.across + u32(place) * lines.along;
        let own = plausible[index];
        var before = false;
        var after = false;
        for (var distance = 1; distance <= search.redun_max_dist; distance++) {
            before = before || says_the_same(id.x, place - distance, own);
            after = after || says_the_same(id.x, place + distance, own);
        }
        if (before && after) {
            plausible[index] = NO_SUPPORT;
        }
    }
}
