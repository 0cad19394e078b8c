//! What ELAS does to the checked disparities: median, speckles, gaps, adaptive mean. The median comes before the speckles
//! and not last, as published, so that it takes outliers out of surfaces before these are measured.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer};

use super::adaptive_mean::{self, Direction};
use super::close_gaps::{self, Gaps};
use super::config::ElasConfig;
use crate::DenseError;
use crate::disparity::band::Band;
use crate::disparity::buffers::Images;
use crate::disparity::config::{DisparityConfig, FilterConfig};
use crate::disparity::median;
use crate::disparity::speckle::SpeckleFilter;
use crate::preprocess::EyeBuffers;

/// The filters of the left view: they begin at [`checked`] and end at [`Images::filtered`].
#[derive(Debug)]
pub(super) struct Filters {
    whole: Band,
    median: Option<BoundKernel>,
    speckle: SpeckleFilter,
    /// Over four pixels each, in order.
    smoothing: Vec<BoundKernel>,
}

impl Filters {
    pub fn new(
        gpu: &Gpu,
        whole: Band,
        images: &Images,
        left: &EyeBuffers,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let elas = &config.elas;
        let speckles = FilterConfig {
            speckle_step_px: elas.speckle_sim_threshold,
            speckle_area_px: elas.speckle_size,
            ..config.filter.clone()
        };
        let smoothing = smoothing(gpu, images, left, elas)?;
        let median = elas.filter_median.then(|| median::bind(gpu, images)).transpose()?;
        Ok(Self { whole, median, speckle: SpeckleFilter::new(gpu, images, &speckles)?, smoothing })
    }

    /// Records all filters.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let words = [self.whole.words, self.whole.height, 1];
        frame.stage("disparity filter", |stage| {
            self.median.iter().try_for_each(|kernel| stage.run(kernel, words))?;
            self.speckle.record(stage, &self.whole)?;
            self.smoothing.iter().try_for_each(|kernel| stage.run(kernel, words))
        })?;
        Ok(())
    }
}

/// Where the filters expect the checked disparities.
pub(super) fn checked<'a>(images: &'a Images, elas: &ElasConfig) -> &'a GpuBuffer<[f32; 4]> {
    if elas.filter_median { &images.matched } else { &images.filtered }
}

/// Gaps along rows and columns, then the smoothing that is wanted.
fn smoothing(
    gpu: &Gpu,
    images: &Images,
    left: &EyeBuffers,
    elas: &ElasConfig,
) -> Result<Vec<BoundKernel>, DenseError> {
    let Images { matched, filtered, .. } = images;
    let there_and_back = [[filtered, matched], [matched, filtered]];
    let mut kernels = Vec::new();
    for (along_columns, pair) in (0..).zip(there_and_back) {
        let gaps = Gaps { width_max: elas.ipol_gap_width, along_columns, padding: [0; 2] };
        kernels.push(close_gaps::bind(gpu, &gaps, images, left, pair)?);
    }
    if elas.filter_adaptive_mean {
        for (along_columns, pair) in (0..).zip(there_and_back) {
            let direction = Direction { along_columns, padding: [0; 3] };
            kernels.push(adaptive_mean::bind(gpu, &direction, images, pair)?);
        }
    }
    Ok(kernels)
}
