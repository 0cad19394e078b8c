//! How well the model, seen from the tracker's pose, fits what is observed.

mod compare_depth;
#[cfg(test)]
mod compare_oracle;
mod judge_frame;

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuError, KernelDeclaration};

use crate::fusion::{HELD_OUT_HISTOGRAM, HISTOGRAM, RESULTS};
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
    /// Every 7th block of pixels, which the warp solver can be told not to use; `None` where the model is in none.
    pub held_out: Option<HeldOut>,
}

/// The error where the solver may not look, and elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Mean over the held-out pixels, metres.
    pub mean_m: f64,
    /// Root of their mean square, metres.
    pub rmse_m: f64,
    /// Mean over all other pixels, metres.
    pub others_mean_m: f64,
}

impl BackProjection {
    /// From two histograms of `bin_m` wide bins, `None` where nothing could be compared. Exact to half a bin; what lies
    /// beyond the last bin counts as lying in it.
    pub(crate) fn from_results(results: &[u32], bin_m: f64) -> Option<Self> {
        let others = Histogram { counts: &results[HISTOGRAM..HELD_OUT_HISTOGRAM], bin_m };
        let held_out = Histogram { counts: &results[HELD_OUT_HISTOGRAM..RESULTS], bin_m };
        let sums: Vec<u32> = others.counts.iter().zip(held_out.counts).map(|(a, b)| a + b).collect();
        let all = Histogram { counts: &sums, bin_m };
        (all.compared() > 0).then(|| Self {
            mean_m: all.mean_of(|error_m| error_m),
            median_m: all.quantile(0.5),
            rmse_m: all.mean_of(|error_m| error_m * error_m).sqrt(),
            p95_m: all.quantile(0.95),
            coverage: all.compared() as f64 / f64::from(results[0].max(1)),
            held_out: (held_out.compared() > 0).then(|| HeldOut {
                mean_m: held_out.mean_of(|error_m| error_m),
                rmse_m: held_out.mean_of(|error_m| error_m * error_m).sqrt(),
                others_mean_m: others.mean_of(|error_m| error_m),
            }),
        })
    }
}

/// Counts of errors in bins of equal width.
struct Histogram<'a> {
    counts: &'a [u32],
    bin_m: f64,
}

impl Histogram<'_> {
    fn compared(&self) -> u64 {
        self.counts.iter().copied().map(u64::from).sum()
    }

    fn center(&self, bin: usize) -> f64 {
        (bin as f64 + 0.5) * self.bin_m
    }

    /// Mean of a function of the error; 0 where there is none.
    fn mean_of(&self, value: impl Fn(f64) -> f64) -> f64 {
        let weighted = |(bin, &count): (usize, &u32)| value(self.center(bin)) * f64::from(count);
        self.counts.iter().enumerate().map(weighted).sum::<f64>() / self.compared().max(1) as f64
    }

    fn quantile(&self, share: f64) -> f64 {
        let rank = share * self.compared() as f64;
        let mut below = 0u64;
        let reached = self.counts.iter().position(|&count| {
            below += u64::from(count);
            below as f64 >= rank
        });
        self.center(reached.unwrap_or(self.counts.len() - 1))
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
        frame.stage("statistics", |stage| {
            let invocations = buffers.observation.pixels().div_ceil(PIXELS_PER_INVOCATION);
            stage.run(&self.compare, [invocations, 1, 1])?;
            stage.run(&self.judge, [1, 1, 1])
        })
    }
}
