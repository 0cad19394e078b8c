//! CPU mirror of `pool_targets.wgsl` in double precision.

use super::aim_patch::PatchTarget;
use super::pool_targets;
use super::testing::{asked, blocks, holding, known, planes, shipped_bench, silence, wish};
use crate::disparity::testing::SIZES;
use crate::testing::Numbers;

const GATE_PX: f64 = 0.45;

#[test]
fn steps_are_averaged_by_weight_over_the_cells_on_the_plane() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let given = planes(size, 61);
        let mut numbers = Numbers::new(62);
        let wishes: Vec<PatchTarget> = given
            .iter()
            .map(|plane| match known(plane[0]) {
                true => asked(plane[0], numbers.next() as f32, 3.0 + numbers.next() as f32),
                false => silence(),
            })
            .collect();
        let (targets, source) = (holding(&bench, &wishes), holding(&bench, &given));
        let pooled = bench.gpu.storage("pooled", given.len()).unwrap();
        let kernel =
            pool_targets::bind(&bench.gpu, &bench.uniform, GATE_PX, (&targets, &source), &pooled).unwrap();
        bench.run(&kernel, blocks(&bench));
        let mut compared = 0;
        for (index, found) in bench.gpu.read(&pooled).unwrap().into_iter().enumerate() {
            let [d, slope_x, slope_y, _] = given[index].map(f64::from);
            if !known(given[index][0]) {
                assert_eq!(found, silence());
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
                let point = wishes[(y * i64::from(size.0) + x) as usize];
                let (step, texture) = wish(point);
                let off = (f64::from(point.disparity) - d - slope_x * dx as f64 - slope_y * dy as f64).abs();
                close |= (off - GATE_PX).abs() < 1e-4;
                if off <= GATE_PX {
                    weight += texture;
                    product += texture * step;
                }
            }
            if close {
                continue;
            }
            let (found_step, found_weight) = wish(found);
            assert!(
                (found_weight / weight - 1.0).abs() < 2e-3,
                "({x}, {y}): {found_weight}, weight {weight}"
            );
            let step = product / weight;
            assert!((found_step - step).abs() < 1e-3, "({x}, {y}): {found_step}, {step}");
            compared += 1;
        }
        assert!(compared * 2 > given.len(), "{compared} compared");
    }
}
