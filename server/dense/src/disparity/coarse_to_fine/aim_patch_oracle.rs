//! CPU mirror of `aim_patch.wgsl` in double precision.

use super::aim_patch;
use super::halve::halved;
use super::testing::{asked, grid, holding, known, planes, shipped_bench, silence, wish};
use crate::disparity::band::Band;
use crate::disparity::testing::SIZES;
use crate::disparity::{DisparityRange, PatchConfig};
use crate::testing::Numbers;

struct Images {
    size: (i64, i64),
    left: Vec<f32>,
    right: Vec<f32>,
}

/// A value of `patch_views.wgsl` for a masked pixel.
const COVERED: f32 = -256.0;

impl Images {
    /// Textures with holes, of values that the packing keeps.
    fn new(size: (u32, u32), seed: u64) -> Self {
        let mut numbers = Numbers::new(seed);
        let mut texture = || {
            let kept = |value: f64| ((value / 256.0 * 32767.0).round() / 32767.0 * 256.0) as f32;
            let value = |draw: f64| if draw > 0.97 { COVERED } else { kept(9.0 * draw) };
            (0..size.0 * size.1).map(|_| value(numbers.next())).collect()
        };
        Self { size: (size.0.into(), size.1.into()), left: texture(), right: texture() }
    }

    /// As `high_pass.wgsl` writes them.
    fn packed(image: &[f32]) -> Vec<u32> {
        let bits = |value: f32| u32::from((value / 256.0 * 32767.0).round() as i16 as u16);
        let pair = |index: usize| bits(image[index]) | bits(image[(index + 1).min(image.len() - 1)]) << 16;
        (0..image.len()).map(pair).collect()
    }

    /// `J^2` and `rho J` of a pixel, and whether rounding may decide otherwise.
    fn share(&self, (x, y): (i64, i64), partner: f64, config: &PatchConfig) -> (f64, f64, bool) {
        let (width, height) = self.size;
        let close = [1.0, width as f64 - 2.0].iter().any(|end| (partner - end).abs() < 1e-3)
            || (partner.fract() - 0.5).abs() > 0.499;
        let inside = partner >= 1.0 && partner < width as f64 - 2.0;
        if !inside || x == 0 || x + 1 >= width || y >= height {
            return (0.0, 0.0, close);
        }
        let row = |image: &[f32], from: i64, count: i64| -> Vec<f64> {
            (from..from + count).map(|x| f64::from(image[(y * width + x) as usize])).collect()
        };
        let start = partner.floor();
        let (left, right) = (row(&self.left, x - 1, 3), row(&self.right, start as i64 - 1, 4));
        if left.iter().chain(&right).any(|&value| value <= f64::from(COVERED)) {
            return (0.0, 0.0, close);
        }
        let part = partner - start;
        let between = |k: usize| (1.0 - part) * right[k] + part * right[k + 1];
        let slope = 0.25 * (between(2) - between(0) + left[2] - left[0]);
        let limit = config.difference_max_levels;
        let difference = (left[1] - between(1)).clamp(-limit, limit);
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
    let images = Images::new(size, 52);
    let passed = [&images.left, &images.right].map(|image| holding(&bench, &Images::packed(image)));
    let of_planes = if cell == 1 { size } else { halved(size) };
    let whole = Band::whole(of_planes, DisparityRange { min_px: 0, groups: 1 });
    let uniform = bench.gpu.uniform("grid", &whole).unwrap();
    let given = planes(of_planes, 53);
    let source = holding(&bench, &given);
    let targets = bench.gpu.storage("targets", given.len()).unwrap();
    let config = &bench.config.patch;
    let kernel =
        aim_patch::bind(&bench.gpu, &uniform, config, (size, cell), &passed, (&source, &targets)).unwrap();
    bench.run(&kernel, [of_planes.0, of_planes.1, 1]);
    let mut compared = 0;
    for (index, found) in bench.gpu.read(&targets).unwrap().into_iter().enumerate() {
        let plane = given[index];
        if !known(plane[0]) {
            assert_eq!(found, silence());
            continue;
        }
        if plane[0].is_infinite() {
            let prior = wish(asked(0.0, 0.0, config.prior_weight as f32));
            assert_eq!(wish(found), prior, "an infinite disparity has no texture");
            continue;
        }
        let at = (index as i64 % i64::from(of_planes.0), index as i64 / i64::from(of_planes.0));
        let (step, weight, close) = images.target(at, plane, cell.into(), config);
        if close {
            continue;
        }
        let (found_step, found_weight) = wish(found);
        assert!((found_step - step).abs() < 3e-3, "{at:?}: {found_step}, step {step}");
        assert!((found_weight / weight - 1.0).abs() < 5e-3, "{at:?}: {found_weight}, weight {weight}");
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
