// Applies the factors of a node's own block. A kernel that imports this declares `factors`, `remainders`, `quotients`,
// `border` and `partials` (per node: r . z, and the six products of the border's columns with z).

fn factor_at(number: u32, row: u32, column: u32) -> f32 {
    return factors[OWN * number + 3u * row + column / 4u][column % 4u];
}

fn precondition(number: u32) {
    var solution: array<f32, 12>;
    for (var row = 0u; row < 12u; row++) {
        var value = remainders[3u * number + row / 4u][row % 4u];
        for (var k = 0u; k < row; k++) {
            value -= factor_at(number, row, k) * solution[k];
        }
        solution[row] = value / factor_at(number, row, row);
    }
    for (var back = 0u; back < 12u; back++) {
        let row = 11u - back;
        var value = solution[row];
        for (var k = row + 1u; k < 12u; k++) {
            value -= factor_at(number, k, row) * solution[k];
        }
        solution[row] = value / factor_at(number, row, row);
    }
    var product = 0.0;
    var columns: array<f32, 6>;
    for (var axis = 0u; axis < 3u; axis++) {
        let z = vec4<f32>(
            solution[4u * axis], solution[4u * axis + 1u], solution[4u * axis + 2u], solution[4u * axis + 3u]);
        quotients[3u * number + axis] = z;
        product += dot(remainders[3u * number + axis], z);
        for (var column = 0u; column < 6u; column++) {
            columns[column] += dot(border[COLUMN * (7u * number + 1u + column) + axis], z);
        }
    }
    partials[2u * number] = vec4<f32>(product, columns[0], columns[1], columns[2]);
    partials[2u * number + 1u] = vec4<f32>(columns[3], columns[4], columns[5], 0.0);
}
