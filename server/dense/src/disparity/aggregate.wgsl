// One of the paths of semi-global matching (Hirschmueller 2008, Eq. 13):
//   L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, min L(q) + P2) - min L(q),   q before p on the path,
// with P2 falling from its maximum by the grey step between q and p. L <= 31 + P2 <= 127, so that the sum of two
// paths fits the byte it is stored in.
//
// costs: matching_cost.wgsl; sums: the same packing. One invocation walks one scan line with all its L in registers:
// hence the unrolling by unroll.rs, without which a loop guard of the WGSL compiler would keep them in memory. A
// slanted path wraps around at the image's side and starts anew there, so all lines are equally long.

struct Walk {
    step_x: i32,
    step_y: i32,
    // 0: sums is written, 1: sums is added to
    accumulate: u32,
    small_penalty: u32,
    jump_penalty_max: u32,
    jump_penalty_min: u32,
    // fall of the jump penalty in sixteenths per grey level
    gradient_sixteenths: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> walk: Walk;
@group(0) @binding(2) var<storage, read> luma: array<u32>;
@group(0) @binding(3) var<storage, read> costs: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> sums: array<vec4<u32>>;

const GROUPS = 1u;
const FAR_ABOVE = 1000u;

fn luma_at(x: i32, y: i32) -> i32 {
    let word = luma[(band.first_row + u32(y)) * band.words + (u32(x) >> 2u)];
    return i32((word >> (8u * (u32(x) & 3u))) & 255u);
}

// Four L from those of the pixel before, `here`, with the one below and the one above them in disparity.
fn advance(here: vec4<u32>, below: u32, above: u32, word: u32, low: u32, jump: u32) -> vec4<u32> {
    let beside = min(vec4<u32>(below, here.xyz), vec4<u32>(here.yzw, above)) + walk.small_penalty;
    return unpack_bytes(word) + min(min(beside, here), vec4<u32>(jump)) - low;
}

@compute @workgroup_size(32)
fn aggregate(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<i32>(i32(band.width), i32(band.rows));
    let along_rows = walk.step_y == 0;
    let lines = select(size.x, size.y, along_rows);
    let steps = select(size.y, size.x, along_rows);
    let line = i32(id.x);
    if (line >= lines) {
        return;
    }
    var x = select(line, select(size.x - 1, 0, walk.step_x > 0), along_rows);
    var y = select(select(size.y - 1, 0, walk.step_y > 0), line, along_rows);
    var path: array<vec4<u32>, 4u * GROUPS>;
    var low = 0u;
    var jump_penalty = 0u;
    var luma_before = luma_at(x, y);
    for (var step = 0; step < steps; step++) {
        let base = u32(y * size.x + x) * GROUPS;
        let jump = low + jump_penalty;
        var below = FAR_ABOVE;
        var least = vec4<u32>(FAR_ABOVE);
        // unroll
        {
            const GROUP = 0u;
            let cost = costs[base + GROUP];
            var above = FAR_ABOVE;
            if (GROUP + 1u < GROUPS) {
                above = path[min(4u * GROUP + 4u, 4u * GROUPS - 1u)].x;
            }
            let a = path[4u * GROUP];
            let b = path[4u * GROUP + 1u];
            let c = path[4u * GROUP + 2u];
            let d = path[4u * GROUP + 3u];
            let next_a = advance(a, below, b.x, cost.x, low, jump);
            let next_b = advance(b, a.w, c.x, cost.y, low, jump);
            let next_c = advance(c, b.w, d.x, cost.z, low, jump);
            let next_d = advance(d, c.w, above, cost.w, low, jump);
            below = d.w;
            least = min(min(least, min(next_a, next_b)), min(next_c, next_d));
            path[4u * GROUP] = next_a;
            path[4u * GROUP + 1u] = next_b;
            path[4u * GROUP + 2u] = next_c;
            path[4u * GROUP + 3u] = next_d;
            var sum = vec4<u32>(pack_bytes(next_a), pack_bytes(next_b), pack_bytes(next_c), pack_bytes(next_d));
            if (walk.accumulate != 0u) {
                // bytes do not carry: both paths are at most 127
                sum += sums[base + GROUP];
            }
            sums[base + GROUP] = sum;
        }
        // end unroll
        low = min(min(least.x, least.y), min(least.z, least.w));
        x += walk.step_x;
        y += walk.step_y;
        let wrapped = x < 0 || x >= size.x;
        x = select(select(x, 0, x >= size.x), size.x - 1, x < 0);
        if (step + 1 < steps) {
            let luma_now = luma_at(x, y);
            let fall = (u32(abs(luma_now - luma_before)) * walk.gradient_sixteenths) >> 4u;
            let floor = walk.jump_penalty_min;
            let falling = walk.jump_penalty_max - min(fall, walk.jump_penalty_max);
            // a free jump forgets the path: L becomes C
            jump_penalty = select(max(falling, floor), 0u, wrapped);
            luma_before = luma_now;
        }
    }
}
