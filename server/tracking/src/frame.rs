//! What comes in, and what is extracted from it.

use std::sync::Arc;

use geometry::{Gray, Mask, Pose, StereoRig};
use nalgebra::{Point2, Point3};

use crate::TrackingError;
use crate::config::{PoseConfig, TrackingConfig};
use crate::feature::grid::FeatureGrid;
use crate::feature::{Extractor, Features, ValidityMap};
use crate::matching::stereo_rows::{Eye, StereoMatch, match_rows};
use crate::solve::reprojection::Observation;

/// A rectified stereo pair, both images of the rig's size.
#[derive(Clone, Copy, Debug)]
pub struct StereoFrame<'a> {
    /// When it was taken.
    pub stamp_ns: u64,
    /// Left image.
    pub left: &'a Gray,
    /// Right image.
    pub right: &'a Gray,
    /// What covers the tissue in the left image.
    pub mask: Option<&'a Mask>,
}

impl StereoFrame<'_> {
    /// Refuses images that are not of the rig's size.
    pub(crate) fn check_size(&self, rig: &StereoRig) -> Result<(), TrackingError> {
        let expected = (rig.left.width_px, rig.left.height_px);
        let sizes = [
            ("left", Some(self.left.size())),
            ("right", Some(self.right.size())),
            ("mask", self.mask.map(Mask::size)),
        ];
        for (what, size) in sizes {
            match size {
                Some(got) if got != expected => return Err(TrackingError::ImageSize { what, expected, got }),
                _ => {}
            }
        }
        Ok(())
    }
}

/// The features of a pair: left keypoints, their depth where the right image has them too. Copies share all but the depth.
#[derive(Clone, Debug)]
pub struct FrameFeatures {
    /// Left features.
    pub features: Arc<Features>,
    /// Counterparts in the right image, by left feature.
    pub stereo: Vec<Option<StereoMatch>>,
    /// Left features by place.
    pub grid: Arc<FeatureGrid>,
    /// Features found in the right image.
    pub right_count: usize,
}

impl FrameFeatures {
    /// Extracts both images in parallel and matches them along rows.
    pub fn extract(
        frame: &StereoFrame,
        rig: &StereoRig,
        extractor: &Extractor,
        config: &TrackingConfig,
    ) -> Self {
        let extract = |image: &Gray, mask: Option<&Mask>| {
            extractor.extract(image, &ValidityMap::new(image, mask, &config.masks))
        };
        let ((features, pyramid), (right_features, right_pyramid)) =
            rayon::join(|| extract(frame.left, frame.mask), || extract(frame.right, None));
        let left_eye = Eye { features: &features, pyramid: &pyramid };
        let right_eye = Eye { features: &right_features, pyramid: &right_pyramid };
        let stereo = match_rows(left_eye, right_eye, rig, &config.stereo);
        let grid = Arc::new(FeatureGrid::new(&features.keypoints, frame.left.size()));
        Self { features: Arc::new(features), stereo, grid, right_count: right_features.len() }
    }

    /// The same with `drift_px` taken off every disparity; what is not in front of the camera then loses its depth.
    #[must_use]
    pub fn without_drift(mut self, rig: &StereoRig, drift_px: f64) -> Self {
        if drift_px == 0.0 {
            return self;
        }
        for (stereo, keypoint) in self.stereo.iter_mut().zip(&self.features.keypoints) {
            *stereo = stereo.and_then(|found| {
                let right_x_px = found.right_x_px + drift_px as f32;
                let depth_m = rig.depth_m(f64::from(keypoint.pixel.x - right_x_px));
                (depth_m > 0.0 && depth_m.is_finite()).then_some(StereoMatch { right_x_px, depth_m, ..found })
            });
        }
        self
    }

    /// Number of left features.
    pub fn len(&self) -> usize {
        self.features.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.features.is_empty()
    }

    /// Features with a depth.
    pub fn stereo_count(&self) -> usize {
        self.stereo.iter().flatten().count()
    }

    /// Left pixel in double precision.
    pub fn pixel(&self, index: usize) -> Point2<f64> {
        self.features.keypoints[index].pixel.map(f64::from)
    }

    /// Feature `index` as an observation, its uncertainty grown with its level.
    pub fn observation(&self, index: usize, scales: &[f32], config: &PoseConfig) -> Observation {
        let level = usize::from(self.features.keypoints[index].level);
        Observation {
            pixel: self.pixel(index),
            right_x_px: self.stereo[index].map(|stereo| f64::from(stereo.right_x_px)),
            sigma_px: config.sigma_px * f64::from(scales[level]),
        }
    }

    /// The point that feature `index` measures, in the world of a camera pose.
    pub fn point_in_world(
        &self,
        index: usize,
        rig: &StereoRig,
        world_from_camera: &Pose,
    ) -> Option<Point3<f64>> {
        let stereo = self.stereo[index]?;
        Some(world_from_camera * rig.left.back_project(&self.pixel(index), stereo.depth_m))
    }

    /// Median depth of the features that have one.
    pub fn median_depth_m(&self) -> Option<f64> {
        self.median_of_stereo(|stereo| stereo.depth_m)
    }

    /// How much lower the right image lies, px, from the features that have a depth.
    pub fn median_row_offset_px(&self) -> Option<f64> {
        self.median_of_stereo(|stereo| f64::from(stereo.row_offset_px))
    }

    fn median_of_stereo(&self, value: impl Fn(&StereoMatch) -> f64) -> Option<f64> {
        let mut values: Vec<f64> = self.stereo.iter().flatten().map(value).collect();
        let middle = values.len().checked_sub(1)? / 2;
        Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}
