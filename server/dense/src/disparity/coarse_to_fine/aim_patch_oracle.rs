//! CPU mirror of `aim_patch.wgsl` in double precision.

use super::aim_patch::{self, Views};
use super::halve::halved;
use super::testing::{grid, holding, known, planes, shipped_bench};
use crate::disparity::band::Band;
use crate::disparity::testing::{NO_DISPARITY, SIZES};
use crate::disparity::{DisparityRange, PatchConfig};
use crate::testing::Numbers;

struct Images {
    size: (i64, i64),
    left: Vec<f32>,
    right: Vec<f32>,
    masked: [Vec<u8>; 2],
}

impl Images {
    /// `J^2` and `rho J` of a pixel, and whether rounding may decide otherwise.
    fn share(&self, (x, y): (i64, i64), partner: f64, config: &PatchConfig) -> (f64, f64, bool) {
        let (width, height) = self.size;
        let close = [1.0, width as f64 - 2.0].iter().any(|end| (partner - end).abs() < 1e-3)
            || ((partner + 0.5).fract() - 0.5).abs() > 0.499;
        let inside = partner >= 1.0 && partner < width as f64 - 2.0;
        if !inside || x == 0 || x + 1 >= width || y >= height {
            return (0.0, 0.0, close);
        }
        let stride = (width as usize).next_multiple_of(4);
        let is_masked = |eye: usize, x: i64| self.masked[eye][y as usize * stride + x as usize] != 0;
        if is_masked(0, x) || is_masked(1, (partner + 0.5) as i64) {
            return (0.0, 0.0, close);
        }
        let at = |image: &[f32], x: i64| f64::from(image[(y * width + x) as usize]);
        let between = |x: f64| {
            let (start, part) = (x.floor(), x - x.floor());
            (1.0 - part) * at(&self.right, start as i64) + part * at(&self.right, start as i64 + 1)
        };
        let of_left = at(&self.left, x + 1) - at(&self.left, x - 1);
        let slope = 0.25 * (between(partner + 1.0) - between(partner - 1.0) + of_left);
        let limit = config.difference_max_levels;
        let difference = (at(&self.left, x) - between(partner)).clamp(-limit, limit);
        (slope * slope, slope * difference, close)
    }

    fn target(
        &self,
        (x, y): (i64, i64),
        plane: [f32; 4],
        cell: i64,
        config: &PatchConfig,
    ) -> (f64, f64, bool) {
        let scale = cell as f64;
        let (mut square, mut product, mut close) = (0.0, 0.0, false);
        for (u, v) in (0..cell).flat_map(|v| (0..cell).map(move |u| (u, v))) {
            let offset = |k: i64| (k as f64 - 0.5 * (scale - 1.0)) / scale;
            let [value, slope_x, slope_y, _] = plane.map(f64::from);
            let d = scale * (value + slope_x * offset(u) + slope_y * offset(v));
            let x = cell * x + u;
            let share = self.share((x, cell * y + v), x as f64 - d, config);
            square += share.0;
            product += share.1;
            close |= share.2;
        }
        let weight = square + config.prior_weight;
        let step = (-product / weight).clamp(-config.step_max_px, config.step_max_px) / scale;
        (step, weight, close)
    }
}

fn check(size: (u32, u32), cell: u32) {
    let bench = shipped_bench(size);
    let mut numbers = Numbers::new(52);
    let mut texture = || (0..size.0 * size.1).map(|_| 9.0 * numbers.next() as f32).collect::<Vec<_>>();
    let (left, right) = (texture(), texture());
    let passed = [holding(&bench, &left), holding(&bench, &right)];
    let of_planes = if cell == 1 { size } else { halved(size) };
    let whole = Band::whole(of_planes, DisparityRange { min_px: 0, groups: 1 });
    let uniform = bench.gpu.uniform("grid", &whole).unwrap();
    let given = planes(of_planes, 53);
    let source = holding(&bench, &given);
    let targets = bench.gpu.storage("targets", given.len()).unwrap();
    let config = &bench.config.patch;
    let views = Views { eyes: bench.input.eyes(), size, cell };
    let kernel =
        aim_patch::bind(&bench.gpu, &uniform, config, (views, &passed), (&source, &targets)).unwrap();
    bench.run(&kernel, [of_planes.0, of_planes.1, 1]);
    let eyes = bench.input.eyes();
    let masked = [&eyes.left.masked, &eyes.right.masked].map(|masked| bench.bytes(masked));
    let images = Images { size: (size.0.into(), size.1.into()), left, right, masked };
    let mut compared = 0;
    for (index, found) in bench.gpu.read(&targets).unwrap().into_iter().enumerate() {
        let plane = given[index];
        if !known(plane[0]) {
            assert_eq!(found, [NO_DISPARITY, NO_DISPARITY, 0.0, 0.0]);
            continue;
        }
        if plane[0].is_infinite() {
            assert_eq!(found[2], config.prior_weight as f32, "an infinite disparity has no texture");
            continue;
        }
        let at = (index as i64 % i64::from(of_planes.0), index as i64 / i64::from(of_planes.0));
        let (step, weight, close) = images.target(at, plane, cell.into(), config);
        if close {
            continue;
        }
        assert!((f64::from(found[1] - plane[0]) - step).abs() < 2e-3, "{at:?}: {found:?}, step {step}");
        assert!((f64::from(found[2]) / weight - 1.0).abs() < 2e-3, "{at:?}: {found:?}, weight {weight}");
        compared += 1;
    }
    assert!(compared * 2 > given.len(), "{compared} compared of {:?}", grid(&bench));
}

#[test]
fn cells_of_one_pixel_and_of_four_ask_for_what_the_mirror_does() {
    for size in SIZES {
        check(size, 1);
        check(size, 2);
    }
}
