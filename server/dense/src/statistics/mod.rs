//! How well the model, seen from the tracker's pose, fits what is observed.

mod compare_depth;
#[cfg(test)]
mod compare_oracle;
mod judge_frame;

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuError, KernelDeclaration};

use crate::fusion::{ERROR_BINS, HISTOGRAM};
use crate::model::FrameBuffers;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 2] = [compare_depth::DECLARATION, judge_frame::DECLARATION];

/// Pixels that one invocation of `compare_depth` takes.
const PIXELS_PER_INVOCATION: u32 = 16;

/// Back-projection error of one frame, taken before it is fused: |model depth - observed depth| over the pixels that
/// have both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackProjection {
    /// Mean, metres.
    pub mean_m: f64,
    /// Median, metres.
    pub median_m: f64,
    /// Root of the mean square, metres.
    pub rmse_m: f64,
    /// 95th percentile, metres.
    pub p95_m: f64,
    /// Share of the measured pixels that show the model.
    pub coverage: f64,
}

impl BackProjection {
    /// From a histogram of `bin_m` wide bins, `None` where nothing could be compared. Exact to half a bin; what lies
    /// beyond the last bin counts as lying in it.
    pub(crate) fn from_results(results: &[u32], bin_m: f64) -> Option<Self> {
        let histogram = &results[HISTOGRAM..HISTOGRAM + ERROR_BINS];
        let compared: u64 = histogram.iter().copied().map(u64::from).sum();
        if compared == 0 {
            return None;
        }
        let center = |bin: usize| (bin as f64 + 0.5) * bin_m;
        let average = |value: &dyn Fn(usize) -> f64| {
            let sum: f64 = histogram.iter().enumerate().map(|(bin, &n)| value(bin) * f64::from(n)).sum();
            sum / compared as f64
        };
        let quantile = |share: f64| {
            let rank = share * compared as f64;
            let mut below = 0u64;
            let reached = histogram.iter().position(|&n| {
                below += u64::from(n);
                below as f64 >= rank
            });
            center(reached.unwrap_or(ERROR_BINS - 1))
        };
        Some(Self {
            mean_m: average(&center),
            median_m: quantile(0.5),
            rmse_m: average(&|bin| center(bin).powi(2)).sqrt(),
            p95_m: quantile(0.95),
            coverage: compared as f64 / f64::from(results[0].max(1)),
        })
    }
}

/// The passes that compare and judge, bound to a frame's buffers.
#[derive(Debug)]
pub(crate) struct Statistics {
    compare: BoundKernel,
    judge: BoundKernel,
}

impl Statistics {
    pub fn new(gpu: &Gpu, frame: &FrameBuffers) -> Result<Self, GpuError> {
        Ok(Self { compare: compare_depth::bind(gpu, frame)?, judge: judge_frame::bind(gpu, frame)? })
    }

    /// Records the comparison and the verdict on the frame.
    pub fn record(&self, frame: &mut FrameRecorder, buffers: &FrameBuffers) -> Result<(), GpuError> {
        frame.clear(&buffers.results);
        frame.stage("statistics", |stage| {
            let invocations = buffers.observation.pixels().div_ceil(PIXELS_PER_INVOCATION);
            stage.run(&self.compare, [invocations, 1, 1])?;
            stage.run(&self.judge, [1, 1, 1])
        })
    }
}
