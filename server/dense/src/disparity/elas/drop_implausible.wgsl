// Support points that too few of their neighbours agree with are dropped.
//
// support: match_support.wgsl. plausible: the same without them. One invocation per candidate.

@group(0) @binding(0) var<uniform> search: Search;
@group(0) @binding(1) var<storage, read> support: array<i32>;
@group(0) @binding(2) var<storage, read_write> plausible: array<i32>;

@compute @workgroup_size(64)
fn drop_implausible(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= search.columns || id.y >= search.rows) {
        return;
    }
    let index = id.y * search.columns + id.x;
    let own = support[index];
    // a point agrees with itself
    var agreeing = 0u;
    let first = max(vec2<i32>(id.xy) - search.incon_window, vec2<i32>(0));
    let last = min(vec2<i32>(id.xy) + search.incon_window, vec2<i32>(i32(search.columns), i32(search.rows)) - 1);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let other = support[u32(y) * search.columns + u32(x)];
            agreeing += u32(other != NO_SUPPORT && abs(other - own) <= search.incon_threshold);
        }
    }
    let kept = own != NO_SUPPORT && agreeing >= search.incon_min_support;
    plausible[index] = select(NO_SUPPORT, own, kept);
}
