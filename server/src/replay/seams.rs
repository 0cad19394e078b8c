//! Steps of brightness in the model where parts that were seen at different times meet: the seams that the paper names as
//! its biggest problem.

use std::collections::BTreeMap;

use dense::Surfel;

/// Side of the cells in which surfels count as neighbours.
const CELL_M: f32 = 1e-3;
/// Surfels last seen more frames apart than this meet at a seam.
const FRAMES_APART: u32 = 30;
/// Cells at seams from which a step is told.
const CELLS_MIN: usize = 20;

/// Mean step of grey levels (0-255) across seams, less the mean difference of neighbours last seen together, which is
/// texture and noise; `None` without a seam.
pub fn color_step_levels(surfels: &[Surfel]) -> Option<f64> {
    let mut cells: BTreeMap<[i32; 3], Vec<&Surfel>> = BTreeMap::new();
    for surfel in surfels {
        let cell = surfel.position.map(|coordinate| (coordinate / CELL_M).floor() as i32);
        cells.entry(cell).or_default().push(surfel);
    }
    let (mut across, mut within) = (Vec::new(), Vec::new());
    for neighbours in cells.values() {
        let first = neighbours.iter().map(|surfel| surfel.stamp).min().unwrap_or(0);
        let last = neighbours.iter().map(|surfel| surfel.stamp).max().unwrap_or(0);
        if last - first > FRAMES_APART {
            let is_new = |&surfel: &&Surfel| last - surfel.stamp < surfel.stamp - first;
            across.extend(step(neighbours.iter().copied().partition(is_new)));
        } else {
            let alternate = neighbours.iter().step_by(2).copied().collect();
            within.extend(step((alternate, neighbours.iter().skip(1).step_by(2).copied().collect())));
        }
    }
    (across.len() >= CELLS_MIN).then(|| mean(&across) - mean(&within))
}

/// Difference of the mean grey levels of two groups, neither empty.
fn step((some, others): (Vec<&Surfel>, Vec<&Surfel>)) -> Option<f64> {
    let level = |group: &[&Surfel]| mean(&group.iter().map(|surfel| grey(surfel.color)).collect::<Vec<_>>());
    (!some.is_empty() && !others.is_empty()).then(|| (level(&some) - level(&others)).abs())
}

fn grey([red, green, blue]: [u8; 3]) -> f64 {
    0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surfel(number: u32, stamp: u32, level: u8) -> Surfel {
        let position = [0.0003 * number as f32, 0.0, 0.05];
        let (normal, color) = ([0.0, 0.0, -1.0], [level; 3]);
        Surfel { id: number, position, normal, radius_m: 3e-4, weight: 5.0, color, stamp }
    }

    /// A strip of texture +-4 levels, its surfels seen by turns early and late.
    fn strip(step: u8) -> Vec<Surfel> {
        let texture = |number: u32| 100 + 4 * (number / 2 % 3) as u8;
        let early_late = |number: u32| if number.is_multiple_of(2) { (10, 0) } else { (100, step) };
        let surfel = |number| surfel(number, early_late(number).0, texture(number) + early_late(number).1);
        (0..300).map(surfel).collect()
    }

    #[test]
    fn a_step_between_old_and_new_parts_is_measured() {
        let stepped = color_step_levels(&strip(30)).unwrap();
        assert!((26.0..34.0).contains(&stepped), "{stepped}");
        let even = color_step_levels(&strip(0)).unwrap();
        assert!(even < 6.0, "{even}");
    }

    #[test]
    fn a_model_seen_at_once_has_no_seam() {
        let surfels: Vec<Surfel> = (0..300).map(|number| surfel(number, 50, (number % 200) as u8)).collect();
        assert_eq!(color_step_levels(&surfels), None);
    }
}
