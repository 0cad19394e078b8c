#import view
#import surfel
#import fusion
// Each surfel registered in this frame covers the pixels around it, so that they make no new surfel, and claims its cell
// of the point grid with a key that orders by weight, then by age.
// A key in the table: 0 | 7 bits of weight | 24 bits of inverted slot. Stored so that the largest wins and 0 is empty;
// surfels have the top bit set and so beat pixels, which do not.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: FusionSettings;
@group(0) @binding(2) var<storage, read> depth: array<f32>;
@group(0) @binding(3) var<storage, read> sigma_z: array<f32>;
@group(0) @binding(4) var<storage, read> results: array<u32>;
@group(0) @binding(5) var<storage, read> geometry: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> orientation: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> history: array<vec4<u32>>;
// one bit per pixel
@group(0) @binding(8) var<storage, read_write> covered: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read_write> claims: array<atomic<u32>>;
// number and slots of the surfels in view
@group(0) @binding(10) var<storage, read> visible: array<u32>;

const REACH_MAX: f32 = 12.0;

@compute @workgroup_size(64)
fn claim_surfels(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= visible[0] || results[ACCEPTED] == 0u {
        return;
    }
    let slot = visible[1u + id.x];
    if history[slot].y != settings.frame {
        return;
    }
    let surfel = geometry[slot].xyz;
    let place = cell_hash(cell_of(surfel, 1.0 / settings.spacing_m), settings.seed) & settings.table_mask;
    let rank = u32(clamp(orientation[slot].w / settings.weight_max, 0.0, 1.0) * 127.0);
    atomicMax(&claims[place], 0x80000000u | (rank << 24u) | (0xffffffu - slot));
    cover(transform_point(view.camera_from_world, surfel));
}

fn cover(point: vec3<f32>) {
    let at = project(view.intrinsics, point);
    let reach = clamp(settings.cover_radius_m * view.intrinsics.x / point.z, 0.5, REACH_MAX);
    let first = vec2<i32>(max(ceil(at - reach), vec2<f32>(0.0)));
    let last = vec2<i32>(min(floor(at + reach), vec2<f32>(view.size) - 1.0));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let offset = vec2<f32>(f32(x), f32(y)) - at;
            let pixel = u32(y) * view.size.x + u32(x);
            let gate = depth_gate(sigma_z[pixel], settings) + settings.cover_radius_m;
            if dot(offset, offset) <= reach * reach && abs(depth[pixel] - point.z) < gate {
                atomicOr(&covered[pixel / 32u], 1u << (pixel % 32u));
            }
        }
    }
}
