// Mean of the nine pixels about a pixel on its row or its column, each the less weight the more its disparity differs.
//
// disparities, smoothed: padded rows, four pixels an element, NO_DISPARITY where unknown. One invocation per four pixels.

struct Direction {
    // 0: along rows, 1: along columns
    along_columns: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> direction: Direction;
@group(0) @binding(2) var<storage, read> disparities: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> smoothed: array<vec4<f32>>;

// px: difference from which a neighbour has no weight
const DIFFERENCE_MAX = 4.0;

struct Sums {
    weight: vec4<f32>,
    offset: vec4<f32>,
}

fn at(word: i32, y: i32) -> vec4<f32> {
    if (word < 0 || word >= i32(band.words) || y < 0 || y >= i32(band.height)) {
        return vec4<f32>(NO_DISPARITY);
    }
    return disparities[u32(y) * band.words + u32(word)];
}

fn add(sums: Sums, centre: vec4<f32>, values: vec4<f32>) -> Sums {
    let offset = values - centre;
    let weight = max(vec4<f32>(0.0), DIFFERENCE_MAX - abs(offset));
    return Sums(sums.weight + weight, sums.offset + weight * offset);
}

@compute @workgroup_size(64)
fn adaptive_mean(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.words || id.y >= band.height) {
        return;
    }
    let word = i32(id.x);
    let y = i32(id.y);
    let centre = at(word, y);
    var sums = Sums(vec4<f32>(DIFFERENCE_MAX), vec4<f32>(0.0));
    if (direction.along_columns == 1u) {
        for (var distance = 1; distance <= 4; distance++) {
            sums = add(sums, centre, at(word, y - distance));
            sums = add(sums, centre, at(word, y + distance));
        }
    } else {
        let west = at(word - 1, y);
        let east = at(word + 1, y);
        sums = add(sums, centre, west);
        sums = add(sums, centre, vec4<f32>(west.yzw, centre.x));
        sums = add(sums, centre, vec4<f32>(west.zw, centre.xy));
        sums = add(sums, centre, vec4<f32>(west.w, centre.xyz));
        sums = add(sums, centre, vec4<f32>(centre.yzw, east.x));
        sums = add(sums, centre, vec4<f32>(centre.zw, east.xy));
        sums = add(sums, centre, vec4<f32>(centre.w, east.xyz));
        sums = add(sums, centre, east);
    }
    let mean = centre + sums.offset / sums.weight;
    smoothed[id.y * band.words + id.x] = select(mean, centre, centre == vec4<f32>(NO_DISPARITY));
}
