//! CPU mirror of the speckle kernels: a flood fill.

use gpu::{FrameRecorder, StageTimer};

use super::DisparityRange;
use super::speckle::SpeckleFilter;
use super::testing::{Bench, NO_DISPARITY, SIZES, config, padded, unpadded};
use crate::testing::Numbers;

fn without_speckles(values: &[f32], (width, height): (u32, u32), step: f32, area: usize) -> Vec<f32> {
    let (width, height) = (width as usize, height as usize);
    let mut seen = vec![false; values.len()];
    let mut kept = vec![NO_DISPARITY; values.len()];
    for start in 0..values.len() {
        let mut surface = Vec::new();
        let mut open = vec![start];
        while let Some(at) = open.pop() {
            if std::mem::replace(&mut seen[at], true) || values[at] == NO_DISPARITY {
                continue;
            }
            surface.push(at);
            let (x, y) = (at % width, at / width);
            let beside = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then(|| at + 1),
                (y > 0).then(|| at.wrapping_sub(width)),
                (y + 1 < height).then(|| at + width),
            ];
            let joined =
                |&other: &usize| values[other] > NO_DISPARITY && (values[other] - values[at]).abs() <= step;
            open.extend(beside.into_iter().flatten().filter(joined));
        }
        if surface.len() >= area {
            surface.iter().for_each(|&at| kept[at] = values[at]);
        }
    }
    kept
}

#[test]
fn small_surfaces_vanish_exactly_as_in_a_flood_fill() {
    for (size, hole_share) in
        SIZES.into_iter().flat_map(|size| [0.05, 0.35, 0.45, 0.7].map(|share| (size, share)))
    {
        let black = geometry::Rgb::filled(size.0, size.1, [0; 3]);
        let mut config = config();
        config.filter.speckle_area_px = 25;
        let bench = Bench::new((&black, &black), DisparityRange { min_px: 0, groups: 1 }, config);
        let mut numbers = Numbers::new(10);
        let source = padded(&bench.whole, |x, y| {
            let step = if (x / 9 + y / 7) % 2 == 0 { 3.0 } else { 0.0 };
            let unknown = numbers.next() * 0.5 + 0.5 < hole_share;
            if unknown { NO_DISPARITY } else { step + 0.3 * numbers.next() as f32 }
        });
        bench.gpu.write(&bench.images.filtered, 0, &source).unwrap();
        let filter = SpeckleFilter::new(&bench.gpu, &bench.images, &bench.config.filter).unwrap();
        let timer = StageTimer::new(&bench.gpu, 1).unwrap();
        let mut frame = FrameRecorder::begin(&bench.gpu, &timer);
        frame.stage("speckle", |stage| filter.record(stage, &bench.whole)).unwrap();
        frame.submit().collect().unwrap();
        let found = unpadded(&bench.whole, &bench.gpu.read(&bench.images.filtered).unwrap());
        let step = bench.config.filter.speckle_step_px as f32;
        let expected = without_speckles(&unpadded(&bench.whole, &source), size, step, 25);
        assert!(found == expected, "{size:?} with {hole_share} holes");
        assert!(hole_share > 0.4 || found.iter().any(|&value| value > NO_DISPARITY));
    }
}
