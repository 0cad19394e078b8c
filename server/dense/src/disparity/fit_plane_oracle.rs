//! CPU mirror of `fit_plane.wgsl` in double precision.

use nalgebra::{Matrix3, Vector3};

use super::fit_plane::{self, PlaneFit};
use super::testing::{Bench, NO_DISPARITY, SIZES, config, padded, unpadded};
use super::{DisparityConfig, DisparityRange};
use crate::testing::Numbers;

struct Window {
    /// x, y, disparity of the known neighbours, relative to the pixel.
    known: Vec<(f64, f64, f64)>,
    close_call: bool,
}

/// `disparity = p[0] + p[1] x + p[2] y`, inliers, residual.
struct Fit {
    plane: Vector3<f64>,
    inliers: usize,
    rms: f64,
}

impl Window {
    fn new(values: &[f32], size: (u32, u32), x: i64, y: i64) -> Self {
        let around = (-4..=4i64).flat_map(|dy| (-4..=4i64).map(move |dx| (dx, dy)));
        let known = around.filter_map(|(dx, dy)| {
            let (x, y) = (x + dx, y + dy);
            let inside = x >= 0 && y >= 0 && x < size.0.into() && y < size.1.into();
            let value = inside.then(|| values[(y * i64::from(size.0) + x) as usize])?;
            (value > NO_DISPARITY).then_some((dx as f64, dy as f64, f64::from(value)))
        });
        Self { known: known.collect(), close_call: false }
    }

    fn fit(&mut self, about: Vector3<f64>, gate: f64) -> Option<Fit> {
        let residual =
            |plane: &Vector3<f64>, &(x, y, d): &(f64, f64, f64)| d - plane.dot(&Vector3::new(1.0, x, y));
        self.close_call |= self.known.iter().any(|point| (residual(&about, point).abs() - gate).abs() < 1e-4);
        let inliers: Vec<_> =
            self.known.iter().filter(|point| residual(&about, point).abs() <= gate).collect();
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for &&(x, y, d) in &inliers {
            let row = Vector3::new(1.0, x, y);
            normal += row * row.transpose();
            right += row * d;
        }
        let n = inliers.len() as f64;
        // determinant of the centred 2 x 2 system
        let spanned = normal.determinant() / n.max(1.0);
        self.close_call |= (spanned - 0.001 * n * n).abs() < 1.0;
        if inliers.len() < 6 || spanned <= 0.001 * n * n {
            return None;
        }
        let plane = normal.try_inverse()? * right;
        let squares: f64 = inliers.iter().map(|point| residual(&plane, point).powi(2)).sum();
        Some(Fit { plane, inliers: inliers.len(), rms: (squares / n).sqrt() })
    }

    /// The value a hole starts from.
    fn hole(&mut self, config: &DisparityConfig) -> Option<f64> {
        let filter = &config.filter;
        let mean = self.known.iter().map(|point| point.2).sum::<f64>() / self.known.len().max(1) as f64;
        let gate = 2.0 * filter.first_gate_px;
        self.close_call |= self.known.iter().any(|point| ((point.2 - mean).abs() - gate).abs() < 1e-3);
        let enough = self.known.len() as f64 >= filter.fill_share_min * 81.0;
        (enough && self.known.iter().all(|point| (point.2 - mean).abs() <= gate)).then_some(mean)
    }
}

fn plane(
    window: &mut Window,
    own: f32,
    spread: f64,
    prior: Option<[f32; 4]>,
    config: &DisparityConfig,
) -> Option<[f64; 4]> {
    let is_hole = own == NO_DISPARITY;
    let origin = if is_hole { window.hole(config)? } else { own.into() };
    let filter = &config.filter;
    let first = match prior {
        Some([_, slope_x, slope_y, _]) => Vector3::new(origin, slope_x.into(), slope_y.into()),
        None => window.fit(Vector3::new(origin, 0.0, 0.0), filter.first_gate_px)?.plane,
    };
    let second = window.fit(first, filter.second_gate_px)?;
    let shift = (second.plane[0] - origin).abs();
    window.close_call |= (shift - filter.shift_max_px).abs() < 1e-4;
    if !is_hole && shift > filter.shift_max_px {
        return None;
    }
    let spread = if is_hole { second.rms } else { spread };
    let missing = 1.0 - second.inliers as f64 / 81.0;
    let terms = [
        config.spread.floor_px,
        config.spread.residual_factor * second.rms,
        spread,
        config.spread.missing_px * missing,
    ];
    let sigma = terms.iter().map(|term| term * term).sum::<f64>().sqrt();
    Some([second.plane[0], second.plane[1], second.plane[2], sigma])
}

#[test]
fn planes_equal_the_mirror_at_edges_holes_and_borders() {
    SIZES.into_iter().for_each(|size| check(size, false));
}

#[test]
fn planes_about_the_slopes_of_a_prior_equal_the_mirror() {
    SIZES.into_iter().for_each(|size| check(size, true));
}

fn check(size: (u32, u32), has_prior: bool) {
    let grey = geometry::Rgb::filled(size.0, size.1, [99; 3]);
    let bench = Bench::new((&grey, &grey), DisparityRange { min_px: 0, groups: 1 }, config());
    let mut numbers = Numbers::new(11);
    let source = padded(&bench.whole, |x, y| {
        let hole = numbers.next() > 0.6 || (x / 20 + y / 11) % 5 == 0;
        let edge = if x > y + 10 { 6.0 } else { 0.0 };
        let value = 20.0 + 0.11 * x as f32 - 0.07 * y as f32 + edge + 0.4 * numbers.next() as f32;
        if hole { NO_DISPARITY } else { value }
    });
    let spreads = padded(&bench.whole, |x, _| 0.01 * x as f32);
    bench.gpu.write(&bench.images.filtered, 0, &source).unwrap();
    bench.gpu.write(&bench.images.spreads, 0, &spreads).unwrap();
    let prior: Vec<[f32; 4]> = (0..size.0 * size.1)
        .map(|_| [7.0, 0.11 + 0.03 * numbers.next() as f32, -0.07 + 0.03 * numbers.next() as f32, 1.0])
        .collect();
    bench.gpu.write(&bench.images.planes, 0, &prior).unwrap();
    let filter = &bench.config.filter;
    let fit = PlaneFit::new(&bench.config);
    let about_prior = fit.about_prior(filter.second_gate_px, 2.0 * filter.first_gate_px);
    let fit = if has_prior { about_prior } else { fit };
    let kernel = fit_plane::bind(&bench.gpu, &bench.images, bench.input.left(), &fit).unwrap();
    bench.run(&kernel, bench.words());
    let values = unpadded(&bench.whole, &source);
    let (mut compared, mut filled) = (0, 0);
    for (index, found) in bench.gpu.read(&bench.images.planes).unwrap().into_iter().enumerate() {
        let (x, y) = (index as i64 % i64::from(size.0), index as i64 / i64::from(size.0));
        let mut window = Window::new(&values, size, x, y);
        let prior = has_prior.then(|| prior[index]);
        let expected = plane(&mut window, values[index], 0.01 * x as f64, prior, &bench.config);
        if window.close_call {
            continue;
        }
        let expected = expected.unwrap_or([f64::from(NO_DISPARITY), 0.0, 0.0, 0.0]);
        let error = (0..4).map(|k| (f64::from(found[k]) - expected[k]).abs()).fold(0.0, f64::max);
        assert!(error < 2e-3, "({x}, {y}) of {size:?}: {found:?}, expected {expected:?}");
        compared += 1;
        filled += usize::from(values[index] == NO_DISPARITY && found[0] > NO_DISPARITY);
    }
    assert!(compared * 2 > values.len() && filled > 0, "{compared} compared, {filled} filled");
}
