//! Takes the worker's results in while it runs.

use std::collections::{BTreeMap, VecDeque};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use dense::{Coloring, DenseSlam, Rendering, Surfel};
use geometry::trajectory::StampedPose;
use geometry::viewpoint::Bounds;
use geometry::{Pose, Rgb};
use recording::export;

use super::frames::FrameRow;
use super::points::{PointFollower, PointFrame};
use super::report::FrameCounts;
use super::stream::StreamMeter;
use super::tracking_rows::TrackingRow;
use super::truth::PointTruth;
use super::unpoisoned;
use crate::convert;
use crate::feature_picture;
use crate::session::worker::{FusedPair, Sink, SinkError, TrackedPair, WorkerError};

/// Samples of a session that its report is made from: two minutes at 30 pairs a second.
const SAMPLES_MAX: usize = 3600;

/// Pairs between tracker and model, at most.
const PAIRS_UNDER_WAY_MAX: usize = 64;

/// Size of the picture of the final model.
const PICTURE_PX: (u32, u32) = (960, 720);

/// What is written while the replay runs.
#[derive(Clone, Debug, Default)]
pub struct Running {
    /// Where the measured depth of each pair goes.
    pub depth_directory: Option<PathBuf>,
    /// Where pictures of the model go, and for every how many pairs.
    pub views: Option<(PathBuf, NonZeroU32)>,
    /// Where the left images with the tracker's features go.
    pub feature_directory: Option<PathBuf>,
}

/// The replay's sink.
pub struct Collector {
    running: Running,
    truth: PointTruth,
    extent: Extent,
    collected: Mutex<Collected>,
}

/// How much is collected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All of a recording, which ends.
    Whole,
    /// The newest of a session, which may go on for hours; its trajectory is in its journal.
    Newest,
}

impl Extent {
    fn samples_max(self) -> usize {
        match self {
            Self::Whole => usize::MAX,
            Self::Newest => SAMPLES_MAX,
        }
    }
}

/// Everything collected so far.
pub struct Collected {
    pub trajectory: Vec<StampedPose>,
    pub counts: FrameCounts,
    pub reasons: BTreeMap<String, u64>,
    pub stages: BTreeMap<&'static str, Stage>,
    pub frame_ms: Samples<f64>,
    pub frames: Samples<FrameRow>,
    pub tracking: Samples<TrackingRow>,
    pub points: PointFollower,
    /// `None` where somebody else publishes the changes.
    pub stream: Option<StreamMeter>,
    pub stamps_ns: Option<(u64, u64)>,
    pub model: Vec<Surfel>,
    /// Deformation nodes after the last fused pair.
    pub nodes: u32,
    pub picture: Option<Rgb>,
    pub error: Option<Arc<WorkerError>>,
    front_ms: BTreeMap<u64, f64>,
}

/// All run times of one stage.
pub struct Stage {
    pub clock: &'static str,
    pub ms: Samples<f64>,
}

impl Collector {
    /// Collects; with a `stream` it takes the model's changes and publishes them there.
    pub fn new(running: Running, stream: Option<StreamMeter>, truth: PointTruth) -> Self {
        Self::with_extent((running, stream, truth), Extent::Whole)
    }

    /// Collects for the report of a session.
    pub fn of_session() -> Self {
        Self::with_extent((Running::default(), None, PointTruth::default()), Extent::Newest)
    }

    fn with_extent(
        (running, stream, truth): (Running, Option<StreamMeter>, PointTruth),
        extent: Extent,
    ) -> Self {
        let samples_max = extent.samples_max();
        let collected = Collected {
            trajectory: Vec::new(),
            counts: FrameCounts::default(),
            reasons: BTreeMap::new(),
            stages: BTreeMap::new(),
            frame_ms: Samples::new(samples_max),
            frames: Samples::new(samples_max),
            tracking: Samples::new(samples_max),
            points: PointFollower::default(),
            stream,
            stamps_ns: None,
            model: Vec::new(),
            nodes: 0,
            picture: None,
            error: None,
            front_ms: BTreeMap::new(),
        };
        Self { running, truth, extent, collected: Mutex::new(collected) }
    }

    /// A pair that does not reach the model, with the reason it is counted under.
    pub fn count_drop(&self, reason: &str, why: &str) {
        tracing::warn!(reason, why, "a pair was dropped");
        let mut collected = unpoisoned(self.collected.lock());
        collected.counts.dropped += 1;
        collected.count_reason(reason);
    }

    pub fn into_collected(self) -> Collected {
        unpoisoned(self.collected.into_inner())
    }
}

/// The newest of many values, and how many there were.
#[derive(Clone, Debug)]
pub struct Samples<T> {
    kept: VecDeque<T>,
    max: usize,
    total: u64,
}

impl<T: Clone> Samples<T> {
    fn new(max: usize) -> Self {
        Self { kept: VecDeque::new(), max, total: 0 }
    }

    fn push(&mut self, value: T) {
        if self.kept.len() >= self.max {
            self.kept.pop_front();
        }
        self.kept.push_back(value);
        self.total += 1;
    }

    /// Those that were kept, oldest first.
    pub fn values(&self) -> Vec<T> {
        self.kept.iter().cloned().collect()
    }

    /// All that there were.
    pub fn total(&self) -> u64 {
        self.total
    }
}

impl Collected {
    /// The warp's solve corrects the pose that the tracker gave: the model is where the corrected one says.
    fn correct_pose(&mut self, stamp_ns: u64, world_from_camera: &Pose) {
        if let Some(pose) = self.trajectory.iter_mut().rev().find(|pose| pose.stamp_ns == stamp_ns) {
            pose.world_from_camera = *world_from_camera;
        }
    }

    fn count_reason(&mut self, reason: &str) {
        *self.reasons.entry(reason.to_string()).or_default() += 1;
    }

    fn time(&mut self, name: &'static str, clock: &'static str, ms: f64) {
        let samples_max = self.frame_ms.max;
        self.stages.entry(name).or_insert_with(|| Stage { clock, ms: Samples::new(samples_max) }).ms.push(ms);
    }
}

impl Collector {
    /// The model as the scope sees it: a picture and its depth.
    fn write_view(&self, pair: &FusedPair, model: &DenseSlam) -> Result<(), SinkError> {
        let Some((directory, every)) = &self.running.views else { return Ok(()) };
        let Some(world_from_camera) = pair.world_from_camera else { return Ok(()) };
        if !pair.sequence.is_multiple_of(u64::from(every.get())) {
            return Ok(());
        }
        let view = dense::View { pinhole: model.rig().left, world_from_camera };
        let Rendering { rgb, depth } = model.render(&view, Coloring::Colour)?;
        export::write_pfm(&numbered_file(directory, pair.sequence, "pfm"), &depth)?;
        let png = recording::encode_png_rgb(&rgb)?;
        Ok(std::fs::write(numbered_file(directory, pair.sequence, "png"), png.bytes)?)
    }
}

impl Collector {
    /// The left image with the tracker's features.
    fn write_features(&self, pair: &TrackedPair) -> Result<(), SinkError> {
        let Some(directory) = &self.running.feature_directory else { return Ok(()) };
        let picture = feature_picture::draw(&pair.left, &pair.report.features);
        let png = recording::encode_png_rgb(&picture)?;
        Ok(std::fs::write(numbered_file(directory, pair.sequence, "png"), png.bytes)?)
    }
}

impl Sink for Collector {
    fn tracked(&self, pair: &TrackedPair) {
        let drawn = self.write_features(pair);
        let mut collected = unpoisoned(self.collected.lock());
        if let Err(error) = drawn {
            collected.error.get_or_insert_with(|| Arc::new(WorkerError::Sink(error)));
        }
        if self.extent == Extent::Whole {
            collected.tracking.push(TrackingRow::new(pair));
        }
        collected.time("rectify", "cpu", pair.rectify_ms);
        collected.time("tracking", "cpu", pair.tracking_ms);
        collected.front_ms.insert(pair.sequence, pair.rectify_ms + pair.tracking_ms);
        if self.extent == Extent::Newest && collected.front_ms.len() > PAIRS_UNDER_WAY_MAX {
            collected.front_ms.pop_first();
        }
        let first_ns = collected.stamps_ns.map_or(pair.stamp_ns, |(first, _)| first);
        collected.stamps_ns = Some((first_ns, pair.stamp_ns));
        if let Some(world_from_camera) = pair.report.world_from_camera {
            collected.counts.tracked += 1;
            if self.extent == Extent::Whole {
                collected.trajectory.push(StampedPose { stamp_ns: pair.stamp_ns, world_from_camera });
            }
            if !pair.quality.allows_fusion() {
                collected.counts.discarded += 1;
                collected.count_reason(pair.quality.name());
            }
        } else {
            collected.counts.lost += 1;
            collected.count_reason("not_tracked");
        }
        if pair.superseded_dense {
            collected.counts.dropped += 1;
            collected.count_reason("fusion_superseded");
        }
    }

    fn fused(&self, pair: &FusedPair, model: &mut DenseSlam) -> Result<(), SinkError> {
        let wanted = self.running.depth_directory.is_some() || !self.truth.is_empty();
        let depth = wanted.then(|| model.depth_map()).transpose()?;
        if let (Some(directory), Some(depth)) = (&self.running.depth_directory, &depth) {
            export::write_pfm(&numbered_file(directory, pair.sequence, "pfm"), depth)?;
        }
        self.write_view(pair, model)?;
        let mut collected = unpoisoned(self.collected.lock());
        for stage in &pair.report.stages {
            collected.time(stage.name, stage.clock.name(), stage.ms);
        }
        let front_ms = collected.front_ms.remove(&pair.sequence).unwrap_or(0.0);
        collected.frame_ms.push(front_ms + pair.dense_ms);
        let Some(world_from_camera) = &pair.world_from_camera else { return Ok(()) };
        collected.correct_pose(pair.stamp_ns, world_from_camera);
        if pair.report.fused {
            collected.counts.fused += 1;
            collected.nodes = pair.report.warp.as_ref().map_or(0, |warp| warp.nodes);
        } else {
            collected.counts.discarded += 1;
            let reason = pair.report.discarded_reason.map_or("not_fused", |reason| reason.name());
            collected.count_reason(reason);
        }
        collected.frames.push(FrameRow::new(pair));
        if let Some(stream) = &mut collected.stream {
            stream.publish(pair.stamp_ns, &model.take_changes(&convert::ENCODING)?)?;
        }
        if let Some(depth) = depth.as_ref().filter(|_| !self.truth.is_empty()) {
            let frame = PointFrame {
                frame: pair.sequence as u32,
                points_in_camera: self.truth.at(pair.stamp_ns),
                world_from_camera,
                depth,
            };
            model.follow(&collected.points.take_up(model.rig(), &frame))?;
            collected.points.note(frame.frame, &model.followed()?);
        }
        Ok(())
    }

    fn idle(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn finished(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        let surfels = model.surfels()?;
        if let Some(stream) = &mut unpoisoned(self.collected.lock()).stream {
            stream.publish(last_stamp_ns, &model.take_changes(&convert::ENCODING)?)?;
            stream.compare(&surfels);
        }
        let picture = picture(model, &surfels)?;
        let mut collected = unpoisoned(self.collected.lock());
        collected.model = surfels;
        collected.picture = Some(picture);
        Ok(())
    }

    fn model_lost(&self, why: &str) {
        tracing::warn!(why, "the model is being rebuilt");
    }

    fn model_rebuilt(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn model_restarted(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        tracing::warn!("the tracker's map was of no use: the model begins anew");
        Ok(())
    }

    fn failed(&self, error: Arc<WorkerError>) {
        unpoisoned(self.collected.lock()).error.get_or_insert(error);
    }
}

/// The file of pair `number` of the recording, counted from 0.
fn numbered_file(directory: &Path, number: u64, extension: &str) -> PathBuf {
    directory.join(format!("{number:06}.{extension}"))
}

fn picture(model: &DenseSlam, surfels: &[Surfel]) -> Result<Rgb, SinkError> {
    let bounds = Bounds::of(surfels.iter().map(|surfel| (&surfel.position, &surfel.normal)));
    let (pinhole, world_from_camera) = bounds.overview(PICTURE_PX);
    Ok(model.render(&dense::View { pinhole, world_from_camera }, Coloring::Colour)?.rgb)
}
