// Winner-takes-all over the summed paths, for the left view and, from the same sums, for the right one.
//
// sums_*: two paths each, packed as in matching_cost.wgsl (with four paths only the first two are read).
// left_winners: per pixel (S << 16 | d) of the least summed cost S, and the least S at least four disparities away.
// right_winners: d per right pixel. One invocation per row, walking right: the right pixel x - d collects its
// candidates in a register that moves up by one disparity with each step.

struct Volumes {
    count: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> volumes: Volumes;
@group(0) @binding(2) var<storage, read> sums_a: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> sums_b: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> sums_c: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> sums_d: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> left_winners: array<vec2<u32>>;
@group(0) @binding(7) var<storage, read_write> right_winners: array<u32>;

const GROUPS = 1u;
const WORST = 0xffffffffu;
const EVEN_BYTES = vec4<u32>(0x00ff00ffu);

fn set_right_winner(row_start: u32, x: i32, key: u32) {
    if (x >= 0 && x < i32(band.width)) {
        right_winners[row_start + u32(x)] = key & 0xffffu;
    }
}

@compute @workgroup_size(32)
fn winner(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.rows) {
        return;
    }
    let row_start = id.x * band.width;
    // candidates of the right pixels x - d for d = 0, 1, 2, 3 modulo four
    var right_0: array<vec4<u32>, GROUPS>;
    var right_1: array<vec4<u32>, GROUPS>;
    var right_2: array<vec4<u32>, GROUPS>;
    var right_3: array<vec4<u32>, GROUPS>;
    // least key of each word of four disparities
    var word_best: array<vec4<u32>, GROUPS>;
    // unroll
    {
        const GROUP = 0u;
        right_0[GROUP] = vec4<u32>(WORST);
        right_1[GROUP] = vec4<u32>(WORST);
        right_2[GROUP] = vec4<u32>(WORST);
        right_3[GROUP] = vec4<u32>(WORST);
    }
    // end unroll
    for (var x = 0u; x < band.width; x++) {
        let base = (row_start + x) * GROUPS;
        var best = vec4<u32>(WORST);
        var moved_up = WORST;
        // unroll
        {
            const GROUP = 0u;
            let a = sums_a[base + GROUP];
            let b = sums_b[base + GROUP];
            var even = (a & EVEN_BYTES) + (b & EVEN_BYTES);
            var odd = ((a >> vec4<u32>(8u)) & EVEN_BYTES) + ((b >> vec4<u32>(8u)) & EVEN_BYTES);
            if (volumes.count == 4u) {
                let c = sums_c[base + GROUP];
                let d = sums_d[base + GROUP];
                even += (c & EVEN_BYTES) + (d & EVEN_BYTES);
                odd += ((c >> vec4<u32>(8u)) & EVEN_BYTES) + ((d >> vec4<u32>(8u)) & EVEN_BYTES);
            }
            let index = vec4<u32>(16u * GROUP) + vec4<u32>(0u, 4u, 8u, 12u);
            let key_0 = (even << vec4<u32>(16u)) | index;
            let key_1 = (odd << vec4<u32>(16u)) | (index + 1u);
            let key_2 = (even & vec4<u32>(0xffff0000u)) | (index + 2u);
            let key_3 = (odd & vec4<u32>(0xffff0000u)) | (index + 3u);
            let of_word = min(min(key_0, key_1), min(key_2, key_3));
            word_best[GROUP] = of_word;
            best = min(best, of_word);
            let from_3 = right_3[GROUP];
            let from_2 = right_2[GROUP];
            let from_1 = right_1[GROUP];
            right_3[GROUP] = min(from_2, key_3);
            right_2[GROUP] = min(from_1, key_2);
            right_1[GROUP] = min(right_0[GROUP], key_1);
            right_0[GROUP] = min(vec4<u32>(moved_up, from_3.xyz), key_0);
            moved_up = from_3.w;
        }
        // end unroll
        let key = min(min(best.x, best.y), min(best.z, best.w));
        let best_word = i32((key & 0xffffu) >> 2u);
        var second = vec4<u32>(WORST);
        // unroll
        {
            const GROUP = 0u;
            let distance = abs(vec4<i32>(4 * i32(GROUP)) + vec4<i32>(0, 1, 2, 3) - best_word);
            second = min(second, select(word_best[GROUP], vec4<u32>(WORST), distance <= vec4<i32>(1)));
        }
        // end unroll
        let second_key = min(min(second.x, second.y), min(second.z, second.w));
        left_winners[row_start + x] = vec2<u32>(key, second_key >> 16u);
        // no later left pixel reaches this right one
        let finished = i32(x) - band.min_disparity - i32(16u * GROUPS - 1u);
        set_right_winner(row_start, finished, right_3[GROUPS - 1u].w);
    }
    // the right pixels whose candidates end at the image's side
    let last = i32(band.width) - 1 - band.min_disparity;
    // unroll
    {
        const GROUP = 0u;
        let a = right_0[GROUP];
        let b = right_1[GROUP];
        let c = right_2[GROUP];
        let d = right_3[GROUP];
        for (var word = 0u; word < 4u; word++) {
            let x = last - i32(16u * GROUP + 4u * word);
            set_right_winner(row_start, x, a[word]);
            set_right_winner(row_start, x - 1, b[word]);
            set_right_winner(row_start, x - 2, c[word]);
            set_right_winner(row_start, x - 3, d[word]);
        }
    }
    // end unroll
}
