//! What becomes of the dense model when the tracker corrects its map. A closed loop bends it, a share in every frame, and
//! poses go along, so that nothing jumps. A map that is begun anew begins a new model.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use dense::FrameCorrection;
use geometry::{Pose, se3};
use tracking::{CorrectionKind, MapCorrection, TrackingReport};

/// A change on its way to the model.
#[derive(Clone, Debug)]
pub(super) enum MapChange {
    /// So much of these corrections, of ascending frames.
    Bend { corrections: Arc<[FrameCorrection]>, share: f64 },
    /// Nothing is where it was.
    Restart,
}

/// Changes, each with the first frame whose pose takes it into account. Frames may be dropped between tracker and model;
/// changes are not: of one bend all shares join into one, so there are never more than loops closed.
#[derive(Clone, Debug, Default)]
pub(super) struct MapChanges(Arc<Mutex<VecDeque<(u32, MapChange)>>>);

impl MapChanges {
    fn waiting(&self) -> MutexGuard<'_, VecDeque<(u32, MapChange)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(&self, frame: u32, change: MapChange) {
        let mut waiting = self.waiting();
        match (&change, waiting.back_mut()) {
            (MapChange::Restart, _) => waiting.clear(),
            (
                MapChange::Bend { corrections: new, share: more },
                Some((last, MapChange::Bend { corrections, share })),
            ) if Arc::ptr_eq(new, corrections) => {
                *last = frame;
                *share += more;
                return;
            }
            _ => (),
        }
        waiting.push_back((frame, change));
    }

    /// Those that the pose of `frame` takes into account.
    pub fn take_until(&self, frame: u32) -> Vec<MapChange> {
        let mut waiting = self.waiting();
        let due = waiting.iter().take_while(|(first, _)| *first <= frame).count();
        waiting.drain(..due).map(|(_, change)| change).collect()
    }
}

/// Follows what the tracker says of its map.
#[derive(Debug)]
pub(super) struct MapFollower {
    changes: MapChanges,
    world_from_start: Pose,
    bend_frames: u32,
    /// Frame of each keyframe, by time stamp.
    keyframes: BTreeMap<u64, u32>,
    bending: Option<Bending>,
}

/// Corrections that the model has in part.
#[derive(Debug)]
struct Bending {
    corrections: Arc<[FrameCorrection]>,
    frames_left: u32,
}

impl MapFollower {
    /// For a tracker whose first camera is at `world_from_start`; bends take `bend_frames`.
    pub fn new(changes: MapChanges, world_from_start: Pose, bend_frames: u32) -> Self {
        let bend_frames = bend_frames.max(1);
        Self { changes, world_from_start, bend_frames, keyframes: BTreeMap::new(), bending: None }
    }

    /// Takes over the report of frame `index`, and gives it the pose in the world as the model has it by then.
    pub fn follow(&mut self, report: &mut TrackingReport, (stamp_ns, index): (u64, u32)) {
        if report.keyframe.is_some() {
            self.keyframes.insert(stamp_ns, index);
        }
        if let Some(correction) = &report.correction {
            self.begin(correction, index);
        }
        let held_back = self.go_on(index);
        let world = held_back * self.world_from_start;
        report.world_from_camera = report.world_from_camera.map(|pose| world * pose);
    }

    fn begin(&mut self, correction: &MapCorrection, index: u32) {
        match correction.kind {
            CorrectionKind::Loop => {
                let corrections = self.in_frames(correction);
                if !corrections.is_empty() {
                    self.finish(index);
                    self.bending = Some(Bending { corrections, frames_left: self.bend_frames });
                }
            }
            CorrectionKind::Restart => {
                self.bending = None;
                self.keyframes.clear();
                self.changes.push(index, MapChange::Restart);
            }
            // the map stands as it was, and the model with it
            CorrectionKind::Relocalization => (),
        }
    }

    fn in_frames(&self, correction: &MapCorrection) -> Arc<[FrameCorrection]> {
        let (world, start) = (self.world_from_start, self.world_from_start.inverse());
        let moved = correction.keyframes.iter().filter_map(|keyframe| {
            let moved = keyframe.world_from_camera_after * keyframe.world_from_camera_before.inverse();
            let frame = *self.keyframes.get(&keyframe.stamp_ns)?;
            Some(FrameCorrection { frame, after_from_before: world * moved * start })
        });
        moved.collect()
    }

    /// Hands one frame's share on; what poses have yet to be held back by.
    fn go_on(&mut self, index: u32) -> Pose {
        let Some(bending) = &mut self.bending else { return Pose::identity() };
        let share = 1.0 / f64::from(self.bend_frames);
        let corrections = Arc::clone(&bending.corrections);
        bending.frames_left -= 1;
        let left = f64::from(bending.frames_left) * share;
        let held_back = corrections.last().map(|last| part(&last.after_from_before, -left));
        if bending.frames_left == 0 {
            self.bending = None;
        }
        self.changes.push(index, MapChange::Bend { corrections, share });
        held_back.unwrap_or_else(Pose::identity)
    }

    /// Hands on what is left of a bend, for another one begins.
    fn finish(&mut self, index: u32) {
        if let Some(Bending { corrections, frames_left }) = self.bending.take() {
            let share = f64::from(frames_left) / f64::from(self.bend_frames);
            self.changes.push(index, MapChange::Bend { corrections, share });
        }
    }
}

/// So much of each correction.
pub(super) fn shares(corrections: &[FrameCorrection], share: f64) -> Vec<FrameCorrection> {
    let of = |correction: &FrameCorrection| FrameCorrection {
        after_from_before: part(&correction.after_from_before, share),
        ..*correction
    };
    corrections.iter().map(of).collect()
}

/// So much of a motion along its screw.
fn part(motion: &Pose, share: f64) -> Pose {
    se3::exp(&(se3::log(motion) * share))
}

#[cfg(test)]
mod tests {
    use geometry::Pose;
    use tracking::{
        CorrectionKind, KeyframeCorrection, KeyframeReason, MapCorrection, Outcome, StereoDrift,
        TrackingReport, TrackingStatistics,
    };

    use super::{MapChange, MapChanges, MapFollower, shares};

    const BEND_FRAMES: u32 = 5;

    fn report(keyframe: bool, correction: Option<MapCorrection>) -> TrackingReport {
        TrackingReport {
            outcome: Outcome::Tracked,
            world_from_camera: Some(Pose::identity()),
            source: None,
            features: Vec::new(),
            statistics: TrackingStatistics::default(),
            keyframe: keyframe.then_some(KeyframeReason::Motion),
            drift: StereoDrift::default(),
            correction,
        }
    }

    /// The newest keyframe goes 8 mm along x, the first one stays; both were at the origin.
    fn closed_loop() -> MapCorrection {
        let keyframe = |stamp_ns, x_m| KeyframeCorrection {
            stamp_ns,
            world_from_camera_before: Pose::identity(),
            world_from_camera_after: Pose::translation(x_m, 0.0, 0.0),
        };
        let keyframes = vec![keyframe(0, 0.0), keyframe(77, 1.0), keyframe(2, 8e-3)];
        MapCorrection { kind: CorrectionKind::Loop, keyframes }
    }

    fn follower(world_from_start: Pose) -> (MapFollower, MapChanges) {
        let changes = MapChanges::default();
        let mut follower = MapFollower::new(changes.clone(), world_from_start, BEND_FRAMES);
        for index in 0..3u32 {
            follower.follow(&mut report(index != 1, None), (u64::from(index), index));
        }
        (follower, changes)
    }

    /// Where the model has the camera in a frame, the fourth of which closes the loop: the tracker has it at 8 mm at once.
    fn x_m_of(follower: &mut MapFollower, index: u32) -> f64 {
        let mut report = report(false, (index == 3).then(closed_loop));
        report.world_from_camera = Some(Pose::translation(8e-3, 0.0, 0.0));
        follower.follow(&mut report, (u64::from(index), index));
        report.world_from_camera.map_or(f64::NAN, |pose| pose.translation.x)
    }

    fn go_on(follower: &mut MapFollower, frames: u32) {
        for index in 3..3 + frames {
            x_m_of(follower, index);
        }
    }

    #[test]
    fn a_closed_loop_moves_poses_and_model_by_the_same_share_in_each_frame() {
        let (mut follower, changes) = follower(Pose::identity());
        let (mut moved_m, mut before_m) = (0.0, 0.0);
        for frame in 3..10 {
            let x_m = x_m_of(&mut follower, frame);
            for change in changes.take_until(frame) {
                let MapChange::Bend { corrections, share } = change else { panic!("a bend") };
                let frames: Vec<u32> = corrections.iter().map(|correction| correction.frame).collect();
                assert_eq!(frames, [0, 2], "a keyframe that is not known is left out");
                let of_frame = shares(&corrections, share);
                assert_eq!(of_frame[0].after_from_before.translation.x, 0.0);
                moved_m += of_frame[1].after_from_before.translation.x;
            }
            assert!((moved_m - x_m).abs() < 1e-12, "frame {frame}: {moved_m} {x_m}");
            assert!((0.0..2e-3).contains(&(x_m - before_m)), "frame {frame}: {before_m} to {x_m}");
            before_m = x_m;
        }
        assert!((moved_m - 8e-3).abs() < 1e-12, "{moved_m}");
    }

    #[test]
    fn shares_for_frames_that_were_dropped_come_with_the_next_one() {
        let (mut follower, changes) = follower(Pose::identity());
        go_on(&mut follower, 4);
        assert!(changes.take_until(2).is_empty());
        let due = changes.take_until(6);
        let [MapChange::Bend { share, .. }] = due.as_slice() else { panic!("one bend: {due:?}") };
        assert!((share - 0.8).abs() < 1e-12, "{share}");
    }

    #[test]
    fn a_second_loop_lets_the_first_come_to_its_end() {
        let (mut follower, changes) = follower(Pose::identity());
        go_on(&mut follower, 2);
        follower.follow(&mut report(false, Some(closed_loop())), (5, 5));
        let due = changes.take_until(5);
        let share = |change: &MapChange| match change {
            MapChange::Bend { share, .. } => *share,
            MapChange::Restart => f64::NAN,
        };
        let got: Vec<f64> = due.iter().map(share).collect();
        assert!(got.len() == 2 && (got[0] - 1.0).abs() < 1e-12 && (got[1] - 0.2).abs() < 1e-12, "{got:?}");
    }

    #[test]
    fn a_new_map_is_a_new_model_and_what_was_to_be_done_to_the_old_one_is_void() {
        let (mut follower, changes) = follower(Pose::identity());
        go_on(&mut follower, 2);
        let restart = MapCorrection { kind: CorrectionKind::Restart, keyframes: Vec::new() };
        let mut first = report(true, Some(restart));
        follower.follow(&mut first, (5, 5));
        assert_eq!(first.world_from_camera, Some(Pose::identity()));
        assert!(matches!(changes.take_until(5).as_slice(), [MapChange::Restart]));
    }

    #[test]
    fn a_session_that_is_gone_on_with_bends_in_its_own_world() {
        let world_from_start =
            Pose::new(nalgebra::Vector3::zeros(), nalgebra::Vector3::z() * std::f64::consts::FRAC_PI_2);
        let (mut follower, changes) = follower(world_from_start);
        go_on(&mut follower, BEND_FRAMES);
        let due = changes.take_until(9);
        let [MapChange::Bend { corrections, .. }] = due.as_slice() else { panic!("one bend: {due:?}") };
        let way = corrections[1].after_from_before.translation.vector;
        assert!((way.y - 8e-3).abs() < 1e-6 && way.x.abs() < 1e-6, "{way}");
    }
}
