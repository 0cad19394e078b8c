//! Features on tissue that moves while the camera rests.

mod support;

use std::collections::BTreeSet;

use geometry::{Gray, Pose, Raster};
use support::{Relief, config, rig, stamp_ns};
use tracking::{StereoFrame, TrackId, TrackedFeature, Tracker, TrackingReport};

/// Rows and columns that the middle of the pushed disc moves by.
const PUSH_PX: (f32, f32) = (6.0, 3.0);
const DISC_RADIUS_PX: f32 = 60.0;
/// Disparity of the relief's middle, by which the disc lies further left in the right image.
const DISPARITY_PX: f32 = 16.0;

/// The image with a disc pushed aside, most in its middle and not at all at its rim.
fn pushed(image: &Gray, centre_x: f32) -> Gray {
    let (push_x, push_y) = PUSH_PX;
    Raster::from_fn(image.width(), image.height(), |x, y| {
        let gain = push_gain(x as f32 - centre_x, y as f32 - 120.0);
        let source = (x as f32 - gain * push_x, y as f32 - gain * push_y);
        blend(image, source.0, source.1)
    })
}

fn push_gain(dx: f32, dy: f32) -> f32 {
    let inside = (1.0 - (dx * dx + dy * dy) / (DISC_RADIUS_PX * DISC_RADIUS_PX)).max(0.0);
    inside * inside
}

fn blend(image: &Gray, x: f32, y: f32) -> u8 {
    let (x0, y0) = (x.floor(), y.floor());
    let pixel = |dx: i64, dy: i64| f32::from(*image.get(x0 as i64 + dx, y0 as i64 + dy).unwrap_or(&0));
    let (tx, ty) = (x - x0, y - y0);
    let row = |dy: i64| pixel(0, dy) * (1.0 - tx) + pixel(1, dy) * tx;
    (row(0) * (1.0 - ty) + row(1) * ty).round() as u8
}

fn track(tracker: &mut Tracker, frame: usize, (left, right): &(Gray, Gray)) -> TrackingReport {
    let frame = StereoFrame { stamp_ns: stamp_ns(frame), left, right, mask: None };
    tracker.track(&frame).expect("images of the rig's size")
}

fn numbers(report: &TrackingReport) -> BTreeSet<TrackId> {
    report.features.iter().filter_map(|feature| feature.track).collect()
}

fn distance_from_push_px(feature: &TrackedFeature) -> f32 {
    let middle = nalgebra::Point2::new(160.0, 120.0);
    (feature.pixel - middle).norm()
}

#[test]
fn a_push_of_the_tissue_is_followed_and_told_from_the_rigid_rest() {
    let mut tracker = Tracker::new(&config(), &rig()).expect("the shipped configuration");
    let still = Relief::render(&rig(), &Pose::identity());
    let moved = (pushed(&still.0, 160.0), pushed(&still.1, 160.0 - DISPARITY_PX));
    let first = track(&mut tracker, 0, &still);
    assert!(first.features.iter().all(|feature| feature.motion.is_none()));
    track(&mut tracker, 1, &still);
    let report = track(&mut tracker, 2, &moved);

    let motions: Vec<_> =
        report.features.iter().filter_map(|feature| Some((feature, feature.motion?))).collect();
    let deforming: Vec<_> = motions.iter().filter(|(_, motion)| !motion.rigid).collect();
    assert!(deforming.len() > 20, "{} deforming of {}", deforming.len(), motions.len());
    let mut far_off = 0;
    for (feature, motion) in &deforming {
        let offset = feature.pixel - nalgebra::Point2::new(160.0, 120.0);
        let expected = nalgebra::Vector2::new(PUSH_PX.0, PUSH_PX.1) * push_gain(offset.x, offset.y);
        let error_px = (feature.pixel - motion.previous_pixel - expected).norm();
        far_off += usize::from(error_px > 2.0);
        assert!(motion.weight > 0.0 && motion.weight <= 1.0);
    }
    assert!(far_off * 10 <= deforming.len(), "{far_off} of {} are more than 2 px off", deforming.len());
    let rigid_far = motions
        .iter()
        .filter(|(feature, motion)| motion.rigid && distance_from_push_px(feature) > DISC_RADIUS_PX);
    assert!(rigid_far.count() > 200);
}

#[test]
fn features_keep_their_numbers_while_nothing_changes() {
    let mut tracker = Tracker::new(&config(), &rig()).expect("the shipped configuration");
    let images = Relief::render(&rig(), &Pose::identity());
    let runs: Vec<_> = (0..4).map(|frame| numbers(&track(&mut tracker, frame, &images))).collect();
    for pair in runs.windows(2) {
        let kept = pair[0].intersection(&pair[1]).count();
        assert!(kept * 10 > pair[0].len() * 7, "{kept} of {} kept", pair[0].len());
    }
}
