//! CPU mirror of `fill_holes.wgsl` in double precision.

use nalgebra::{Matrix3, Vector3};

use super::fill_holes::{self, STRIDES};
use super::testing::{grid, holding, known, planes, shipped_bench};
use crate::disparity::testing::{NO_DISPARITY, SIZES};

/// Disparity and slopes from the known pixels around, none where the kernel may decide either way.
fn around(
    source: &[[f32; 4]],
    size: (u32, u32),
    (x, y): (i64, i64),
    stride: i64,
) -> Option<Option<[f64; 3]>> {
    let (mut normal, mut right, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for (u, v) in (-2..=2i64).flat_map(|v| (-2..=2i64).map(move |u| (u, v))) {
        let (x, y) = (x + stride * u, y + stride * v);
        if x < 0 || y < 0 || x >= size.0.into() || y >= size.1.into() {
            continue;
        }
        let d = source[(y * i64::from(size.0) + x) as usize][0];
        if known(d) {
            let row = Vector3::new(1.0, u as f64, v as f64);
            normal += row * row.transpose();
            right += row * f64::from(d);
            count += 1.0;
        }
    }
    if count < 5.0 {
        return Some(None);
    }
    let spanned = normal.determinant() / f64::max(count, 1.0);
    if (spanned - 0.001 * count * count).abs() < 0.1 {
        return None;
    }
    if spanned <= 0.001 * count * count {
        return Some(None);
    }
    let plane = normal.try_inverse().map(|inverse| inverse * right)?;
    Some(Some([plane[0], plane[1] / stride as f64, plane[2] / stride as f64]))
}

#[test]
fn holes_take_the_plane_around_them_and_the_rest_stays() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let mut given = planes(size, 51);
        for (index, plane) in given.iter_mut().enumerate() {
            let x = index as u32 % size.0;
            if x > size.0 / 2 || !plane[0].is_finite() {
                *plane = [NO_DISPARITY, 0.0, 0.0, 0.0];
            }
        }
        let source = holding(&bench, &given);
        let filled = bench.gpu.storage("filled", given.len()).unwrap();
        for stride in STRIDES {
            let kernel = fill_holes::bind(&bench.gpu, &bench.uniform, stride, &source, &filled).unwrap();
            bench.run(&kernel, grid(&bench));
            let (mut holes, mut found_any) = (0, 0);
            for (index, found) in bench.gpu.read(&filled).unwrap().into_iter().enumerate() {
                if known(given[index][0]) {
                    assert_eq!(found, given[index]);
                    continue;
                }
                let at = (index as i64 % i64::from(size.0), index as i64 / i64::from(size.0));
                let Some(expected) = around(&given, size, at, stride.into()) else { continue };
                holes += 1;
                match expected {
                    None => assert_eq!(found[0], NO_DISPARITY, "{at:?}, stride {stride}"),
                    Some(plane) => {
                        let error =
                            (0..3).map(|k| (f64::from(found[k]) - plane[k]).abs()).fold(0.0, f64::max);
                        assert!(error < 1e-2, "{at:?}, stride {stride}: {found:?}, expected {plane:?}");
                        assert_eq!(found[3], stride as f32);
                        found_any += 1;
                    }
                }
            }
            assert!(holes > 100 && (found_any > 0 || stride > 9), "{holes} holes, {found_any} filled");
        }
    }
}
