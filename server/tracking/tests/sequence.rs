//! The tracker on rendered sequences.

mod support;

use geometry::{Gray, Pose, Raster};
use support::{Relief, config, rig, scope_motion, stamp_ns};
use tracking::{
    CorrectionKind, MappingPace, Outcome, PoseSource, StereoFrame, Tracker, TrackingConfig, TrackingError,
    TrackingMode, TrackingReport,
};

fn tracker() -> Tracker {
    Tracker::new(&config(), &rig()).expect("the shipped configuration")
}

fn track(tracker: &mut Tracker, frame: usize, (left, right): &(Gray, Gray)) -> TrackingReport {
    let frame = StereoFrame { stamp_ns: stamp_ns(frame), left, right, mask: None };
    tracker.track(&frame).expect("images of the rig's size")
}

fn position_error_mm(report: &TrackingReport, truth: &Pose) -> f64 {
    let pose = report.world_from_camera.expect("a pose");
    (pose.translation.vector - truth.translation.vector).norm() * 1e3
}

fn black() -> (Gray, Gray) {
    (Raster::filled(320, 240, 0), Raster::filled(320, 240, 0))
}

#[test]
fn a_moving_scope_is_followed_to_a_fraction_of_a_millimetre() {
    let mut tracker = tracker();
    for frame in 0..30 {
        let truth = scope_motion(frame);
        let report = track(&mut tracker, frame, &Relief::render(&rig(), &truth));
        assert_eq!(report.outcome, Outcome::Tracked, "frame {frame}");
        let error_mm = position_error_mm(&report, &truth);
        assert!(error_mm < 0.4, "{error_mm} mm at frame {frame}");
        assert_eq!(report.features.iter().filter(|f| f.matched).count(), report.statistics.inliers);
    }
    assert!(tracker.map().keyframe_count() > 1);
}

#[test]
fn a_blackout_is_reported_as_lost_and_ended_by_recovery() {
    let mut tracker = tracker();
    let outcomes: Vec<Outcome> = (0..16)
        .map(|frame| {
            let truth = scope_motion(frame);
            let dark = (8..12).contains(&frame);
            let images = if dark { black() } else { Relief::render(&rig(), &truth) };
            let report = track(&mut tracker, frame, &images);
            assert_eq!(report.world_from_camera.is_none(), dark, "frame {frame}");
            if !dark {
                let error_mm = position_error_mm(&report, &truth);
                assert!(error_mm < 0.5, "{error_mm} mm at frame {frame}");
            }
            report.outcome
        })
        .collect();
    assert!(outcomes[..8].iter().all(|outcome| *outcome == Outcome::Tracked));
    assert!(outcomes[8..12].iter().all(|outcome| *outcome == Outcome::Lost { since_ns: stamp_ns(8) }));
    assert_eq!(outcomes[12], Outcome::Recovered);
    assert!(outcomes[13..].iter().all(|outcome| *outcome == Outcome::Tracked));
}

#[test]
fn a_jump_that_no_window_covers_is_bridged_by_descriptors() {
    let mut tracker = tracker();
    let jump = Pose::new([0.012, -0.006, 0.004].into(), [0.0, 0.0, 1.2].into());
    track(&mut tracker, 0, &Relief::render(&rig(), &Pose::identity()));
    let report = track(&mut tracker, 1, &Relief::render(&rig(), &jump));
    assert_eq!((report.outcome, report.source), (Outcome::Tracked, Some(PoseSource::LastFrame)));
    assert!(position_error_mm(&report, &jump) < 0.5);
}

#[test]
fn a_map_that_began_with_something_else_is_forgotten() {
    let mut tracker = tracker();
    let elsewhere = Relief::render(&rig(), &Pose::translation(7.3, -4.1, 0.0));
    let tissue = Relief::render(&rig(), &Pose::identity());
    assert_eq!(track(&mut tracker, 0, &elsewhere).outcome, Outcome::Tracked);
    let frames = config().recovery.restart_frames as usize;
    for frame in 1..=frames {
        assert_eq!(track(&mut tracker, frame, &tissue).outcome, Outcome::Lost { since_ns: stamp_ns(1) });
    }
    let report = track(&mut tracker, frames + 1, &tissue);
    assert_eq!((report.outcome, report.source), (Outcome::Tracked, Some(PoseSource::FirstFrame)));
    assert_eq!(report.correction.map(|correction| correction.kind), Some(CorrectionKind::Restart));
    assert_eq!(report.world_from_camera, Some(Pose::identity()));
    assert_eq!(tracker.map().keyframe_count(), 1);
    assert_eq!(track(&mut tracker, frames + 2, &tissue).outcome, Outcome::Tracked);
}

#[test]
fn a_young_map_whose_view_comes_back_as_it_would_be_forgotten_is_kept() {
    let mut tracker = tracker();
    let elsewhere = Relief::render(&rig(), &Pose::translation(7.3, -4.1, 0.0));
    let tissue = Relief::render(&rig(), &Pose::identity());
    assert_eq!(track(&mut tracker, 0, &tissue).outcome, Outcome::Tracked);
    let frames = config().recovery.restart_frames as usize;
    for frame in 1..=frames {
        assert_eq!(track(&mut tracker, frame, &elsewhere).outcome, Outcome::Lost { since_ns: stamp_ns(1) });
    }
    let report = track(&mut tracker, frames + 1, &tissue);
    assert_eq!(report.outcome, Outcome::Recovered);
    assert!(position_error_mm(&report, &Pose::identity()) < 0.5);
}

#[test]
fn live_mapping_is_taken_when_it_is_there() {
    let mut tracker = Tracker::with_pace(&config(), &rig(), MappingPace::Asynchronous).expect("a tracker");
    for frame in 0..12 {
        let truth = scope_motion(2 * frame);
        let report = track(&mut tracker, frame, &Relief::render(&rig(), &truth));
        assert_eq!(report.outcome, Outcome::Tracked, "frame {frame}");
        let error_mm = position_error_mm(&report, &truth);
        assert!(error_mm < 0.5, "{error_mm} mm at frame {frame}");
    }
}

#[test]
fn a_resting_camera_stays_where_it_is() {
    let mut tracker = tracker();
    let images = Relief::render(&rig(), &Pose::identity());
    track(&mut tracker, 0, &images);
    for frame in 1..4 {
        let report = track(&mut tracker, frame, &images);
        assert_eq!(report.source, Some(PoseSource::Standstill));
        assert_eq!(report.world_from_camera, Some(Pose::identity()));
    }
}

#[test]
fn a_creeping_camera_is_followed_in_small_steps() {
    let mut tracker = tracker();
    for frame in 0..12 {
        let truth = Pose::translation(0.00006 * frame as f64, 0.0, 0.0);
        let report = track(&mut tracker, frame, &Relief::render(&rig(), &truth));
        let error_mm = position_error_mm(&report, &truth);
        assert!(error_mm < 0.3, "{error_mm} mm at frame {frame}");
    }
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| {
            let mut tracker = tracker();
            (0..8)
                .map(|frame| track(&mut tracker, frame, &Relief::render(&rig(), &scope_motion(frame))))
                .collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn black_grey_and_saturated_images_start_nothing() {
    let mut tracker = tracker();
    for (frame, value) in [0, 128, 255].into_iter().enumerate() {
        let image = Raster::filled(320, 240, value);
        let report = track(&mut tracker, frame, &(image.clone(), image));
        assert_eq!(report.outcome, Outcome::NotInitialized);
        assert_eq!(report.world_from_camera, None);
        assert!(report.features.is_empty());
    }
}

#[test]
fn the_world_starts_with_the_first_usable_frame() {
    let mut tracker = tracker();
    assert_eq!(track(&mut tracker, 0, &black()).outcome, Outcome::NotInitialized);
    let report = track(&mut tracker, 1, &Relief::render(&rig(), &scope_motion(5)));
    assert_eq!(report.world_from_camera, Some(Pose::identity()));
    assert_eq!(report.source, Some(PoseSource::FirstFrame));
}

#[test]
fn nothing_is_tracked_under_the_instrument_mask() {
    let mut tracker = tracker();
    let (left, right) = Relief::render(&rig(), &Pose::identity());
    let mask = Raster::from_fn(320, 240, |x, _| u8::from(x >= 160));
    let frame = StereoFrame { stamp_ns: 1, left: &left, right: &right, mask: Some(&mask) };
    let report = tracker.track(&frame).expect("images of the rig's size");
    assert!(report.features.len() > 200);
    assert!(report.features.iter().all(|feature| feature.pixel.x < 158.0));
}

#[test]
fn wrong_sizes_and_old_stamps_are_refused_and_change_nothing() {
    let mut tracker = tracker();
    let (left, right) = Relief::render(&rig(), &Pose::identity());
    let small = Raster::filled(160, 120, 90);
    let mut refused = |stamp_ns, left, right, mask| {
        tracker.track(&StereoFrame { stamp_ns, left, right, mask }).expect_err("a refusal")
    };
    let wrong = |what| TrackingError::ImageSize { what, expected: (320, 240), got: (160, 120) };
    assert_eq!(refused(5, &small, &right, None), wrong("left"));
    assert_eq!(refused(5, &left, &small, None), wrong("right"));
    assert_eq!(refused(5, &left, &right, Some(&small)), wrong("mask"));
    track(&mut tracker, 0, &(left.clone(), right.clone()));
    let again = StereoFrame { stamp_ns: stamp_ns(0), left: &left, right: &right, mask: None };
    let error = tracker.track(&again).expect_err("a refusal");
    assert_eq!(error, TrackingError::Stamp { stamp_ns: stamp_ns(0), last_ns: stamp_ns(0) });
    assert_eq!(track(&mut tracker, 1, &(left, right)).outcome, Outcome::Tracked);
}

#[test]
fn unusable_configurations_and_rigs_are_refused_by_name() {
    let mut bad = config();
    bad.features.levels = 0;
    let error = Tracker::new(&bad, &rig()).expect_err("a refusal");
    assert_eq!(error.to_string(), "tracking.features.levels = 0, it must be 1 to 16");
    let mut tiny = rig();
    (tiny.left.width_px, tiny.left.height_px) = (64, 48);
    assert_eq!(
        Tracker::new(&config(), &tiny).expect_err("a refusal"),
        TrackingError::RigSize { width: 64, height: 48, levels: 8 }
    );
    let flat = geometry::StereoRig { baseline_m: f64::NAN, ..rig() };
    assert!(matches!(Tracker::new(&config(), &flat), Err(TrackingError::Rig { field: "baseline_m", .. })));
}

#[test]
fn the_map_stays_within_its_caps() {
    let mut small = config();
    (small.map.keyframes_max, small.map.points_max) = (10, 1000);
    small.mapping.redundant_share = 2.0;
    (small.map.frames_between_min, small.map.motion_max_depth_share) = (1, 0.0);
    let mut tracker = Tracker::new(&small, &rig()).expect("a valid configuration");
    for frame in 0..16 {
        track(&mut tracker, frame, &Relief::render(&rig(), &scope_motion(frame)));
        assert!(tracker.map().keyframe_count() <= 10 && tracker.map().point_count() <= 1000);
    }
    assert_eq!(tracker.map().keyframe_count(), 10);
}

fn tracker_of(mode: TrackingMode) -> Tracker {
    Tracker::new(&TrackingConfig { mode, ..config() }, &rig()).expect("a valid configuration")
}

#[test]
fn odometry_follows_without_a_map_and_goes_on_after_a_blackout_from_where_it_was() {
    let mut tracker = tracker_of(TrackingMode::Odometry);
    for frame in 0..12 {
        let truth = scope_motion(frame);
        let report = track(&mut tracker, frame, &Relief::render(&rig(), &truth));
        let error_mm = position_error_mm(&report, &truth);
        assert!(error_mm < 1.0, "{error_mm} mm at frame {frame}");
        assert_eq!(report.statistics.keyframes, 1);
    }
    for frame in 12..15 {
        let report = track(&mut tracker, frame, &black());
        assert_eq!(report.outcome, Outcome::Lost { since_ns: stamp_ns(12) });
    }
    let elsewhere = Pose::translation(0.3, 0.2, 0.0);
    let after = |frame: usize| elsewhere * scope_motion(frame);
    track(&mut tracker, 15, &Relief::render(&rig(), &after(15)));
    let report = track(&mut tracker, 16, &Relief::render(&rig(), &after(16)));
    assert_eq!(report.outcome, Outcome::Tracked);
    // it was not told of the way in the dark
    let way_mm = position_error_mm(&report, &scope_motion(11));
    assert!(way_mm < 3.0, "{way_mm} mm from where it was lost");
}

#[test]
fn without_tracking_the_camera_is_where_it_started() {
    let mut tracker = tracker_of(TrackingMode::None);
    for frame in 0..3 {
        let report = track(&mut tracker, frame, &Relief::render(&rig(), &scope_motion(10 * frame)));
        assert_eq!((report.outcome, report.world_from_camera), (Outcome::Tracked, Some(Pose::identity())));
    }
}
