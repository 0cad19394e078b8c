//! CPU mirror of `pool_targets.wgsl` in double precision.

use super::pool_targets;
use super::testing::{grid, holding, known, planes, shipped_bench};
use crate::disparity::testing::{NO_DISPARITY, SIZES};
use crate::testing::Numbers;

const GATE_PX: f64 = 0.45;

#[test]
fn steps_are_averaged_by_weight_over_the_cells_on_the_plane() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let given = planes(size, 61);
        let mut numbers = Numbers::new(62);
        let asked: Vec<[f32; 4]> = given
            .iter()
            .map(|plane| match known(plane[0]) {
                true => [plane[0], plane[0] + numbers.next() as f32, 3.0 + numbers.next() as f32, 0.0],
                false => [NO_DISPARITY, NO_DISPARITY, 0.0, 0.0],
            })
            .collect();
        let (targets, source) = (holding(&bench, &asked), holding(&bench, &given));
        let pooled = bench.gpu.storage("pooled", given.len()).unwrap();
        let kernel =
            pool_targets::bind(&bench.gpu, &bench.uniform, GATE_PX, (&targets, &source), &pooled).unwrap();
        bench.run(&kernel, grid(&bench));
        let mut compared = 0;
        for (index, found) in bench.gpu.read(&pooled).unwrap().into_iter().enumerate() {
            let [d, slope_x, slope_y, _] = given[index].map(f64::from);
            if !known(given[index][0]) {
                assert_eq!(found, [NO_DISPARITY, NO_DISPARITY, 0.0, 0.0]);
                continue;
            }
            if d.is_infinite() {
                continue;
            }
            let (x, y) = (index as i64 % i64::from(size.0), index as i64 / i64::from(size.0));
            let (mut weight, mut product, mut close) = (0.0, 0.0, false);
            for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                let (x, y) = (x + dx, y + dy);
                if x < 0 || y < 0 || x >= size.0.into() || y >= size.1.into() {
                    continue;
                }
                let point = asked[(y * i64::from(size.0) + x) as usize].map(f64::from);
                let off = (point[0] - d - slope_x * dx as f64 - slope_y * dy as f64).abs();
                close |= (off - GATE_PX).abs() < 1e-4;
                if off <= GATE_PX {
                    weight += point[2];
                    product += point[2] * (point[1] - point[0]);
                }
            }
            if close {
                continue;
            }
            assert!((f64::from(found[2]) - weight).abs() < 1e-3, "({x}, {y}): {found:?}, weight {weight}");
            let step = product / weight;
            assert!((f64::from(found[1] - found[0]) - step).abs() < 1e-4, "({x}, {y}): {found:?}, {step}");
            compared += 1;
        }
        assert!(compared * 2 > given.len(), "{compared} compared");
    }
}
