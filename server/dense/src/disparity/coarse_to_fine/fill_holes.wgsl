// Extends known surfaces into holes of the coarsest disparity image, so that every finer pixel has somewhere to start:
// the least-squares plane through what is known among 5 x 5 pixels `stride` apart. What was known stays. The standard
// deviation of what is filled is the stride: a guess that grows with the distance carried.
//
// source, filled: disparity, slopes along x and y, standard deviation per pixel, unpadded rows; NO_DISPARITY where
// unknown. One invocation per pixel.

struct Filling {
    stride: i32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> filling: Filling;
@group(0) @binding(2) var<storage, read> source: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> filled: array<vec4<f32>>;

const KNOWN_MIN = 5.0;

fn plane_around(x: i32, y: i32) -> vec4<f32> {
    var n = 0.0;
    var sums = vec4<f32>(0.0);
    var products = vec2<f32>(0.0);
    var squares = vec3<f32>(0.0);
    for (var v = -2; v <= 2; v++) {
        for (var u = -2; u <= 2; u++) {
            let at = vec2<i32>(x, y) + filling.stride * vec2<i32>(u, v);
            if (at.x < 0 || at.y < 0 || at.x >= i32(band.width) || at.y >= i32(band.height)) {
                continue;
            }
            let d = source[u32(at.y) * band.width + u32(at.x)].x;
            if (known(d)) {
                let p = vec2<f32>(f32(u), f32(v));
                n += 1.0;
                sums += vec4<f32>(p, d, 0.0);
                products += p * d;
                squares += vec3<f32>(p.x * p.x, p.x * p.y, p.y * p.y);
            }
        }
    }
    let mean = sums.xyz / max(n, 1.0);
    let xx = squares.x - n * mean.x * mean.x;
    let xy = squares.y - n * mean.x * mean.y;
    let yy = squares.z - n * mean.y * mean.y;
    let xd = products.x - n * mean.x * mean.z;
    let yd = products.y - n * mean.y * mean.z;
    let determinant = xx * yy - xy * xy;
    if (n < KNOWN_MIN || determinant <= 0.001 * n * n) {
        return vec4<f32>(NO_DISPARITY, 0.0, 0.0, 0.0);
    }
    let slope = vec2<f32>(yy * xd - xy * yd, xx * yd - xy * xd) / determinant;
    let value = mean.z - dot(slope, mean.xy);
    return vec4<f32>(value, slope / f32(filling.stride), f32(filling.stride));
}

@compute @workgroup_size(64)
fn fill_holes(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let index = id.y * band.width + id.x;
    var plane = source[index];
    if (!known(plane.x)) {
        plane = plane_around(i32(id.x), i32(id.y));
    }
    filled[index] = plane;
}
