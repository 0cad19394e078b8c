//! What the tests of these kernels share.

use bytemuck::Pod;
use gpu::GpuBuffer;
use half::f16;

use super::aim_patch::PatchTarget;
use crate::disparity::testing::{Bench, NO_DISPARITY, config, hostile};
use crate::disparity::{DisparityConfig, DisparityRange};
use crate::testing::Numbers;

/// Planes of two slanted surfaces with holes, noise, and here and there a NaN or an infinity.
pub fn planes(size: (u32, u32), seed: u64) -> Vec<[f32; 4]> {
    let mut numbers = Numbers::new(seed);
    let plane = |index: u32| {
        let (x, y) = ((index % size.0) as f32, (index / size.0) as f32);
        let edge = if x > y + 10.0 { 3.0 } else { 0.0 };
        let value = 6.0 + 0.05 * x - 0.03 * y + edge + 0.3 * numbers.next() as f32;
        match numbers.next() {
            draw if draw > 0.99 => [f32::NAN, 0.0, f32::INFINITY, 1.0],
            draw if draw > 0.98 => [f32::INFINITY, 0.1, 0.1, 1.0],
            draw if draw > 0.7 => [NO_DISPARITY, 0.0, 0.0, 0.0],
            draw => [value, 0.05 + 0.01 * draw as f32, -0.03, 0.2],
        }
    };
    (0..size.0 * size.1).map(plane).collect()
}

/// A pair of random images of `size`, on the GPU.
pub fn bench(size: (u32, u32), config: DisparityConfig) -> Bench {
    let (left, right) = (hostile(size, 41), hostile(size, 42));
    Bench::new((&left, &right), DisparityRange { min_px: 0, groups: 1 }, config)
}

/// As [`bench`], configured as shipped.
pub fn shipped_bench(size: (u32, u32)) -> Bench {
    bench(size, config())
}

/// A buffer that holds `values`.
pub fn holding<T: Pod>(bench: &Bench, values: &[T]) -> GpuBuffer<T> {
    let buffer = bench.gpu.storage("test values", values.len()).unwrap();
    bench.gpu.write(&buffer, 0, values).unwrap();
    buffer
}

/// Whether a disparity says something, as `known` of `common.wgsl`.
pub fn known(disparity: f32) -> bool {
    disparity > -1.0e5
}

/// What a cell that knows nothing asks for.
pub fn silence() -> PatchTarget {
    asked(NO_DISPARITY, 0.0, 0.0)
}

/// As `target_of` of `patch_targets.wgsl`.
pub fn asked(disparity: f32, step: f32, weight: f32) -> PatchTarget {
    let halves = [step, weight.sqrt()].map(|value| u32::from(f16::from_f32(value).to_bits()));
    PatchTarget { disparity, step_and_texture: halves[0] | halves[1] << 16 }
}

/// Step and weight, as `wish_of` of `patch_targets.wgsl`.
pub fn wish(target: PatchTarget) -> (f64, f64) {
    let half = |bits: u32| f64::from(f16::from_bits((bits & 0xffff) as u16));
    (half(target.step_and_texture), half(target.step_and_texture >> 16).powi(2))
}

/// The grid's columns and rows, and one layer.
pub fn grid(bench: &Bench) -> [u32; 3] {
    [bench.whole.width, bench.whole.height, 1]
}

/// The grid's blocks of 2 x 2.
pub fn blocks(bench: &Bench) -> [u32; 3] {
    grid(bench).map(|cells| cells.div_ceil(2))
}
