//! Five frames over the run: what the scope saw, the model, the depth, and how far they are apart.

use std::collections::BTreeMap;

use geometry::{DepthMap, Raster, Rgb};

use crate::ReportingError;
use crate::axes;
use crate::colors;
use crate::picture::{Picture, read_png};
use crate::run::{Run, read_depth};
use crate::truth::Known;

/// As many as the paper's figure has.
const FRAMES: usize = 5;
/// Difference with the strongest colour.
const DIFFERENCE_MAX_M: f64 = 2e-3;

/// One frame of the run.
pub(crate) struct FrameView {
    pub number: u64,
    pub pictures: Vec<Picture>,
}

/// Five frames, fewer where the run wrote fewer.
pub(crate) fn frames(run: &Run, known: &Known) -> Result<Vec<FrameView>, ReportingError> {
    let chosen = choose(run, known);
    let (images, truths) = (known.images(&chosen)?, known.depths(&chosen)?);
    let mut depths = BTreeMap::new();
    for &number in &chosen {
        depths.extend(read_depth(&run.depths, number)?.map(|depth| (number, depth)));
    }
    let range_m = range_m(&depths);
    let view = |&number: &u64| {
        let (depth, truth) = (depths.get(&number), truths.get(&number));
        let mut pictures = Vec::new();
        pictures.extend(images.get(&number).map(|image| Picture::new("scope, left".into(), image)));
        pictures.extend(run.views.get(&number).map(|path| Picture::new("model".into(), &read_png(path)?)));
        pictures.extend(depth.map(|depth| depth_picture(depth, range_m)));
        let model_depth = read_depth(&run.view_depths, number)?;
        if let Some((model, depth)) = model_depth.as_ref().zip(depth) {
            pictures.extend(difference_picture("model less measured depth", model, depth));
        }
        if let Some((depth, truth)) = depth.zip(truth) {
            pictures.extend(difference_picture("measured less true depth", depth, truth));
        }
        let pictures = pictures.into_iter().collect::<Result<_, ReportingError>>()?;
        Ok(FrameView { number, pictures })
    };
    chosen.iter().map(view).collect()
}

/// Spread over the run; among those with a view and a true depth where there are enough of them.
fn choose(run: &Run, known: &Known) -> Vec<u64> {
    let written: Vec<u64> = match run.views.is_empty() {
        false => run.views.keys().copied().collect(),
        true => run.depths.keys().copied().collect(),
    };
    let with_truth = known.frames_with_depth();
    let best: Vec<u64> = written.iter().copied().filter(|number| with_truth.contains(number)).collect();
    let numbers = if best.len() >= FRAMES { best } else { written };
    // The model is still empty in the first view.
    spread(if numbers.len() > FRAMES { &numbers[1..] } else { &numbers })
}

fn spread(numbers: &[u64]) -> Vec<u64> {
    let Some(last) = numbers.len().checked_sub(1) else { return Vec::new() };
    let count = FRAMES.min(numbers.len());
    (0..count).map(|place| numbers[place * last / (count - 1).max(1)]).collect()
}

fn range_m(depths: &BTreeMap<u64, DepthMap>) -> [f64; 2] {
    let pixels = depths.values().flat_map(DepthMap::pixels);
    axes::most_of(
        pixels.filter(|&&depth_m| colors::is_known(depth_m)).map(|&depth_m| f64::from(depth_m)).collect(),
    )
}

fn depth_picture(depth: &DepthMap, range_m: [f64; 2]) -> Result<Picture, ReportingError> {
    let [near_mm, far_mm] = range_m.map(|depth_m| depth_m * 1e3);
    let colored: Rgb = colors::of_depth(depth, range_m);
    Picture::new(format!("measured depth, {near_mm:.0} to {far_mm:.0} mm, near is bright"), &colored)
}

/// `None` where the maps do not fit together, or know no pixel in common.
fn difference_picture(
    what: &str,
    left: &DepthMap,
    right: &DepthMap,
) -> Option<Result<Picture, ReportingError>> {
    if left.size() != right.size() {
        return None;
    }
    let (width, height) = left.size();
    let difference = Raster::from_fn(width, height, |x, y| {
        let (left_m, right_m) = (left[(x, y)], right[(x, y)]);
        let known = colors::is_known(left_m) && colors::is_known(right_m);
        if known { left_m - right_m } else { f32::NAN }
    });
    let known = difference.pixels().iter().filter(|value| value.is_finite());
    let (sum_m, count) =
        known.fold((0.0, 0_u64), |(sum, count), value| (sum + f64::from(value.abs()), count + 1));
    if count == 0 {
        return None;
    }
    let mean_mm = sum_m / count as f64 * 1e3;
    let caption =
        format!("{what}: mean {mean_mm:.2} mm, strongest colour at {:.0} mm", DIFFERENCE_MAX_M * 1e3);
    Some(Picture::new(caption, &colors::of_difference(&difference, DIFFERENCE_MAX_M)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(&[0, 10, 20, 30, 40, 50, 60, 70, 80]), [0, 20, 40, 60, 80]);
        assert_eq!(spread(&[3, 7]), [3, 7]);
        assert_eq!(spread(&[3]), [3]);
        assert!(spread(&[]).is_empty());
    }

    #[test]
    fn maps_of_different_sizes_have_no_difference() {
        let maps = [DepthMap::filled(4, 4, 0.1), DepthMap::filled(8, 4, 0.1)];
        assert!(difference_picture("test", &maps[0], &maps[1]).is_none());
        let unknown = DepthMap::filled(4, 4, 0.0);
        assert!(difference_picture("test", &maps[0], &unknown).is_none());
        let same = difference_picture("test", &maps[0], &maps[0]).unwrap().unwrap();
        assert!(same.caption.contains("mean 0.00 mm"), "{}", same.caption);
    }
}
