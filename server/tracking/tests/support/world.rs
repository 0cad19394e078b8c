//! A world of distinct points and cameras that see them without images.

use std::sync::Arc;

use geometry::{Gray, Pose, Raster, StereoRig};
use nalgebra::{Point2, Point3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use tracking::FrameFeatures;
use tracking::feature::grid::FeatureGrid;
use tracking::feature::{Descriptor, Features, Keypoint};
use tracking::local_mapping::{MappingContext, PosedFrame, insert_keyframe};
use tracking::map::{KeyframeId, Map, PointId};
use tracking::matching::stereo_rows::StereoMatch;
use tracking::solve::reprojection::project;

use crate::support::{config, rig};

/// Points on a rough surface 80 mm in front of the first camera, each with its own looks.
pub struct World {
    points: Vec<(Point3<f64>, Descriptor)>,
    random: Pcg64Mcg,
    /// Standard deviation of features, px.
    pub noise_px: f64,
    /// Descriptor bits that differ from sighting to sighting.
    pub noise_bits: usize,
    /// Points farther than this have no depth by stereo, m.
    pub stereo_reach_m: f64,
}

/// A frame, and which point of the world each feature shows.
pub struct Seen {
    pub frame: Arc<FrameFeatures>,
    pub points: Vec<usize>,
}

impl World {
    pub fn new(count: usize, seed: u128) -> Self {
        let mut random = Pcg64Mcg::new(seed);
        let points = (0..count)
            .map(|_| {
                let position = Point3::new(
                    random.random_range(-0.15..0.25),
                    random.random_range(-0.15..0.25),
                    random.random_range(0.07..0.09),
                );
                (position, Descriptor(random.random()))
            })
            .collect();
        Self { points, random, noise_px: 0.3, noise_bits: 20, stereo_reach_m: 1.0 }
    }

    /// What a camera sees.
    pub fn look(&mut self, rig: &StereoRig, camera_from_world: &Pose) -> Seen {
        let mut seen = Vec::new();
        let mut features = Features::default();
        let mut stereo = Vec::new();
        for (index, (position, descriptor)) in self.points.iter().enumerate() {
            let point = camera_from_world * position;
            let exact = project(rig, &point);
            let inside = (4.0..316.0).contains(&exact.x) && (4.0..236.0).contains(&exact.y);
            if !inside {
                continue;
            }
            let mut noisy = |value: f64| value + self.noise_px * self.random.random_range(-1.7..1.7);
            let pixel = Point2::new(noisy(exact.x) as f32, noisy(exact.y) as f32);
            let right_x_px = noisy(exact.z) as f32;
            let mut descriptor = *descriptor;
            for _ in 0..self.noise_bits {
                descriptor.0[self.random.random_range(0..4)] ^= 1 << self.random.random_range(0..64);
            }
            features.keypoints.push(Keypoint { pixel, level: 0, angle_rad: 0.0, score: 50 });
            features.descriptors.push(descriptor);
            let depth_m = rig.depth_m(f64::from(pixel.x - right_x_px));
            let near = point.z <= self.stereo_reach_m;
            stereo.push(near.then_some(StereoMatch { right_x_px, depth_m, row_offset_px: 0.0 }));
            seen.push(index);
        }
        let image: Gray = Raster::filled(rig.left.width_px, rig.left.height_px, 0);
        let grid = FeatureGrid::new(&features.keypoints, image.size());
        let right_count = features.len();
        Seen {
            frame: Arc::new(FrameFeatures {
                features: features.into(),
                stereo,
                grid: grid.into(),
                right_count,
            }),
            points: seen,
        }
    }
}

/// What mapping reads, with the shipped configuration.
pub fn context() -> MappingContext {
    let config = config();
    let factor = config.features.scale_factor;
    let scales = (0..config.features.levels).map(|level| factor.powi(level as i32)).collect();
    MappingContext { rig: rig(), scales, config }
}

/// Inserts a keyframe whose matches are the newest map points that the last `memory` keyframes have of what it sees.
pub struct Inserter {
    /// Map point and number of the last keyframe that saw it, by point of the world.
    known: Vec<Option<(PointId, usize)>>,
    inserted: usize,
    memory: usize,
}

impl Inserter {
    pub fn new(memory: usize) -> Self {
        Self { known: Vec::new(), inserted: 0, memory }
    }

    pub fn insert(
        &mut self,
        map: &mut Map,
        seen: &Seen,
        pose: &Pose,
        context: &MappingContext,
    ) -> KeyframeId {
        self.inserted += 1;
        let most = seen.points.iter().max().map_or(0, |most| most + 1);
        self.known.resize(self.known.len().max(most), None);
        let recent = |known: &Option<(PointId, usize)>| {
            known.filter(|(_, last)| last + self.memory >= self.inserted).map(|(id, _)| id)
        };
        let posed = PosedFrame {
            stamp_ns: self.inserted as u64 * 1_000_000,
            camera_from_world: *pose,
            frame: Arc::clone(&seen.frame),
            resting: false,
            matches: seen.points.iter().map(|&point| recent(&self.known[point])).collect(),
        };
        let id = insert_keyframe(map, &posed, &context.rig, &context.config.map);
        let keyframe = map.keyframe(id).expect("just inserted");
        for (&point, mapped) in seen.points.iter().zip(keyframe.points()) {
            self.known[point] = mapped.map(|mapped| (mapped, self.inserted));
        }
        id
    }
}
