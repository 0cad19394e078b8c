// Least energy of each pixel of both views among the candidate disparities of its grid cell. These have no part in the
// prior, so that this runs while the support points are still being triangulated.
//
// energies: per pixel (energy << 10 | disparity index), NO_MATCH where there is no texture or no candidate; the energy
// in quarters of the descriptors' difference, with the prior's largest bonus added so that none is negative.
// One invocation per pixel and view.

@group(0) @binding(0) var<uniform> band: Band;
@group(0) @binding(1) var<uniform> search: Search;
@group(0) @binding(2) var<storage, read> descriptors: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> candidates: array<u32>;
@group(0) @binding(4) var<storage, read_write> energies: array<u32>;

@compute @workgroup_size(64)
fn match_candidates(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= band.width || id.y >= band.height) {
        return;
    }
    let at = pixel_index(id.z, id.x, id.y);
    let own = descriptors[at];
    var least = NO_MATCH;
    if (!is_silent(own) && texture(own) >= search.match_texture) {
        let row = pixel_index(1u - id.z, 0u, id.y);
        let cell = (id.z * search.cell_rows + id.y / search.cell) * search.cell_columns + id.x / search.cell;
        for (var word = 0u; word < search.mask_words; word++) {
            var bits = candidates[cell * search.mask_words + word];
            while (bits != 0u) {
                let index = 32u * word + countTrailingZeros(bits);
                bits &= bits - 1u;
                let partner = i32(id.x) + partner_step(id.z) * (band.min_disparity + i32(index));
                if (partner >= 0 && partner < i32(band.width)) {
                    let energy = 4u * difference(own, descriptors[row + u32(partner)]) + search.bonus[0].x;
                    least = min(least, (energy << 10u) | index);
                }
            }
        }
    }
    energies[at] = least;
}
