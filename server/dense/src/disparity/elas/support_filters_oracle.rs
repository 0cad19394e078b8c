//! CPU mirrors of `drop_implausible.wgsl` and `drop_redundant.wgsl`.

use geometry::Rgb;

use super::drop_redundant::Lines;
use super::testing::{ElasBench, random_support};
use super::triangulation::NO_SUPPORT;
use super::{drop_implausible, drop_redundant};
use crate::disparity::testing::{SIZES, config};

fn bench(size: (u32, u32)) -> ElasBench {
    let black = Rgb::filled(size.0, size.1, [0; 3]);
    let mut config = config();
    config.elas.redun_max_dist = 3;
    ElasBench::new((&black, &black), config)
}

#[test]
fn points_without_enough_agreeing_neighbours_are_dropped() {
    for size in SIZES {
        let bench = bench(size);
        let source = random_support(&bench.search, 72);
        bench.gpu().write(&bench.buffers.support, 0, &source).unwrap();
        let kernel = drop_implausible::bind(bench.gpu(), &bench.buffers).unwrap();
        bench.bench.run(&kernel, [bench.search.columns, bench.search.rows, 1]);
        let found = bench.gpu().read(&bench.buffers.plausible).unwrap();
        let columns = bench.search.columns as usize;
        let agrees = |index: usize, other: usize| {
            let near = (index % columns).abs_diff(other % columns) <= 5
                && (index / columns).abs_diff(other / columns) <= 5;
            near && source[other] != NO_SUPPORT && (source[other] - source[index]).abs() <= 5
        };
        for (index, &found) in found.iter().enumerate() {
            let count = (0..source.len()).filter(|&other| agrees(index, other)).count();
            let kept = source[index] != NO_SUPPORT && count >= 5;
            assert_eq!(
                found,
                if kept { source[index] } else { NO_SUPPORT },
                "candidate {index}, {count} agree"
            );
        }
    }
}

/// Walks the lines one after the other.
fn thinned(mut points: Vec<i32>, lines: &Lines) -> Vec<i32> {
    let index =
        |line: u32, place: i64| (line * lines.across) as usize + place as usize * lines.along as usize;
    for (line, place) in
        (0..lines.count).flat_map(|line| (0..i64::from(lines.length)).map(move |place| (line, place)))
    {
        let own = points[index(line, place)];
        let side = |direction: i64| {
            (1..=3i64).map(|distance| place + direction * distance).any(|place| {
                (0..i64::from(lines.length)).contains(&place) && {
                    let other = points[index(line, place)];
                    other != NO_SUPPORT && (other - own).abs() <= 1
                }
            })
        };
        if side(-1) && side(1) {
            points[index(line, place)] = NO_SUPPORT;
        }
    }
    points
}

#[test]
fn points_between_others_that_say_the_same_are_dropped_in_order() {
    for size in SIZES {
        let bench = bench(size);
        let source = random_support(&bench.search, 73);
        bench.gpu().write(&bench.buffers.plausible, 0, &source).unwrap();
        let mut expected = source.clone();
        for lines in Lines::both(&bench.search) {
            let kernel = drop_redundant::bind(bench.gpu(), &lines, &bench.buffers).unwrap();
            bench.bench.run(&kernel, [lines.count, 1, 1]);
            expected = thinned(expected, &lines);
            assert_eq!(bench.gpu().read(&bench.buffers.plausible).unwrap(), expected, "{lines:?}");
        }
        let count = |points: &[i32]| points.iter().filter(|&&point| point != NO_SUPPORT).count();
        assert!(count(&expected) * 10 < count(&source) * 9, "{} of {}", count(&expected), count(&source));
    }
}
