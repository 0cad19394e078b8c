//! FAST-9 corners (Rosten and Drummond 2006).
//!
//! The score of a pixel of value `c` is the largest `s` such that nine contiguous pixels of its Bresenham circle of
//! radius 3 are all `>= c + s`, or all `<= c - s`; it is a corner at threshold `t` where `s > t`. Scores are
//! byte minima and maxima over 32 pixels at once, which the compiler turns into vector instructions, wider ones where
//! the processor has them.

use geometry::{Gray, Raster};

use crate::dispatch::dispatch;

/// Circle of radius 3, clockwise from the top: `(dx, dy)`.
pub const CIRCLE: [(i32, i32); 16] = [
    (0, -3),
    (1, -3),
    (2, -2),
    (3, -1),
    (3, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 3),
    (-1, 3),
    (-2, 2),
    (-3, 1),
    (-3, 0),
    (-3, -1),
    (-2, -2),
    (-1, -3),
];

const RADIUS: usize = 3;
/// Pixels judged at once. Loops over fewer are unrolled at the development profile's optimisation level before they
/// can be vectorised, and take twenty times as long.
const LANES: usize = 32;
type Lanes = [u8; LANES];

/// A corner on one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// FAST score, grey levels.
    pub score: u8,
}

dispatch! {
    /// Scores above `threshold` of all pixels at least 3 from the border; 0 elsewhere. Images narrower than 38 have none.
    pub fn score_map(image: &Gray, threshold: u8) -> Raster<u8> = score_map_portable;
}

#[inline(always)]
fn score_map_portable(image: &Gray, threshold: u8) -> Raster<u8> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut scores = Raster::filled(image.width(), image.height(), 0);
    if width < LANES + 2 * RADIUS || height < 2 * RADIUS + 1 {
        return scores;
    }
    let last_start = width - RADIUS - LANES;
    let circle = CIRCLE.map(|(dx, dy)| offset_in_window(width, dx, dy));
    for y in RADIUS..height - RADIUS {
        let window = &image.pixels()[(y - RADIUS) * width..(y + RADIUS + 1) * width];
        let out = &mut scores.pixels_mut()[y * width..(y + 1) * width];
        for start in (RADIUS..width - RADIUS).step_by(LANES) {
            let start = start.min(last_start);
            let pixels = &window[start - RADIUS..];
            let centre = lanes(pixels, RADIUS * width + RADIUS);
            if any_may_exceed(pixels, centre, &circle, threshold) {
                let block = score_block(pixels, centre, &circle);
                for (target, score) in out[start..start + LANES].iter_mut().zip(block) {
                    *target = if score > threshold { score } else { 0 };
                }
            }
        }
    }
    scores
}

dispatch! {
    /// Corners of a score map: strict local maxima over 3x3, at least `border` from the edge, in row order.
    pub fn local_maxima(scores: &Raster<u8>, border: u32) -> Vec<Corner> = local_maxima_portable;
}

#[inline(always)]
fn local_maxima_portable(scores: &Raster<u8>, border: u32) -> Vec<Corner> {
    let (width, height) = (scores.width() as usize, scores.height() as usize);
    let border = (border as usize).max(1);
    let mut corners = Vec::new();
    if width <= 2 * border || height <= 2 * border {
        return corners;
    }
    let end = width - border;
    for y in border..height - border {
        let rows = [y - 1, y, y + 1].map(|row| scores.row(row as u32));
        if end - border < LANES {
            let maxima = (border..end).filter(|&x| is_maximum(rows, x));
            corners.extend(maxima.map(|x| corner_at(rows, x, y)));
            continue;
        }
        let mut x = border;
        while x < end {
            // the last block reaches back into the one before
            let start = x.min(end - LANES);
            if is_any_set(lanes(rows[1], start)) {
                push_block(rows, start, (x, y), &mut corners);
            }
            x = start + LANES;
        }
    }
    corners
}

/// Of equal neighbours the first in row order wins.
fn is_maximum(rows: [&[u8]; 3], x: usize) -> bool {
    let score = rows[1][x];
    let before = [rows[0][x - 1], rows[0][x], rows[0][x + 1], rows[1][x - 1]];
    let after = [rows[1][x + 1], rows[2][x - 1], rows[2][x], rows[2][x + 1]];
    before.iter().all(|&other| other < score) && after.iter().all(|&other| other <= score)
}

fn corner_at(rows: [&[u8]; 3], x: usize, y: usize) -> Corner {
    Corner { x: x as u32, y: y as u32, score: rows[1][x] }
}

/// The maxima of row `y` among the [`LANES`] pixels from column `start`, without those before `first`.
#[inline(always)]
fn push_block(rows: [&[u8]; 3], start: usize, (first, y): (usize, usize), corners: &mut Vec<Corner>) {
    let flags = maxima(rows, start);
    for (group, bytes) in flags.as_chunks::<8>().0.iter().enumerate() {
        let mut set = u64::from_le_bytes(*bytes);
        while set != 0 {
            let x = start + 8 * group + set.trailing_zeros() as usize / 8;
            if x >= first {
                corners.push(corner_at(rows, x, y));
            }
            set &= set - 1;
        }
    }
}

/// 1 where [`is_maximum`] holds, else 0.
#[inline(always)]
fn maxima(rows: [&[u8]; 3], x: usize) -> Lanes {
    let [above, here, below] = rows;
    let score = lanes(here, x);
    let before =
        max(&max(lanes(above, x - 1), lanes(above, x)), &max(lanes(above, x + 1), lanes(here, x - 1)));
    let after =
        max(&max(lanes(here, x + 1), lanes(below, x - 1)), &max(lanes(below, x), lanes(below, x + 1)));
    let mut flags = [0; LANES];
    for i in 0..LANES {
        flags[i] = u8::from(score[i] > before[i]) & u8::from(score[i] >= after[i]);
    }
    flags
}

/// Where the pixel at a circle offset lies in a window of seven rows of which the first three columns are left of the
/// centre.
fn offset_in_window(width: usize, dx: i32, dy: i32) -> usize {
    (dy + RADIUS as i32) as usize * width + (dx + RADIUS as i32) as usize
}

#[inline(always)]
fn lanes(pixels: &[u8], start: usize) -> &Lanes {
    pixels[start..start + LANES].try_into().expect("a slice of LANES bytes")
}

/// Whether any byte is not 0. By words: the maximum of bytes is taken one byte after the other.
#[inline(always)]
fn is_any_set(bytes: &Lanes) -> bool {
    bytes.as_chunks::<8>().0.iter().fold(0, |set, chunk| set | u64::from_le_bytes(*chunk)) != 0
}

/// Whether any score may lie above the threshold: nine contiguous pixels of the circle always hold two neighbouring compass
/// points, which bounds the scores.
#[inline(always)]
fn any_may_exceed(pixels: &[u8], centre: &Lanes, circle: &[usize; 16], threshold: u8) -> bool {
    let [north, east, south, west] = [0, 4, 8, 12].map(|point| lanes(pixels, circle[point]));
    let mut above = [0; LANES];
    for i in 0..LANES {
        let highest = north[i].max(south[i]).min(east[i].max(west[i]));
        let lowest = north[i].min(south[i]).max(east[i].min(west[i]));
        let bound = highest.saturating_sub(centre[i]).max(centre[i].saturating_sub(lowest));
        above[i] = bound.saturating_sub(threshold);
    }
    is_any_set(&above)
}

#[inline(always)]
fn score_block(pixels: &[u8], centre: &Lanes, circle: &[usize; 16]) -> Lanes {
    let mut around = [[0; LANES]; 16];
    for (values, &offset) in around.iter_mut().zip(circle) {
        *values = *lanes(pixels, offset);
    }
    let highest = best_arc(&around, min, max);
    let lowest = best_arc(&around, max, min);
    let mut score = [0; LANES];
    for i in 0..LANES {
        score[i] = highest[i].saturating_sub(centre[i]).max(centre[i].saturating_sub(lowest[i]));
    }
    score
}

/// `best` over all arcs of nine of the `worst` in the arc: max of minima for bright arcs, min of maxima for dark ones.
///
/// Arcs `2k..=2k+8` and `2k+1..=2k+9` share eight pixels, whose extremum is built by doubling. Written out: a loop's
/// indices would keep the pixels out of the registers.
#[inline(always)]
fn best_arc(
    circle: &[Lanes; 16],
    worst: impl Fn(&Lanes, &Lanes) -> Lanes,
    best: impl Fn(&Lanes, &Lanes) -> Lanes,
) -> Lanes {
    let two = |k: usize| worst(&circle[2 * k + 1], &circle[(2 * k + 2) % 16]);
    let two = [two(0), two(1), two(2), two(3), two(4), two(5), two(6), two(7)];
    let four = |k: usize| worst(&two[k], &two[(k + 1) % 8]);
    let four = [four(0), four(1), four(2), four(3), four(4), four(5), four(6), four(7)];
    let arcs = |k: usize| {
        worst(&worst(&four[k], &four[(k + 2) % 8]), &best(&circle[2 * k], &circle[(2 * k + 9) % 16]))
    };
    let halves = [
        best(&best(&arcs(0), &arcs(1)), &best(&arcs(2), &arcs(3))),
        best(&best(&arcs(4), &arcs(5)), &best(&arcs(6), &arcs(7))),
    ];
    best(&halves[0], &halves[1])
}

#[inline(always)]
fn min(a: &Lanes, b: &Lanes) -> Lanes {
    let mut out = [0; LANES];
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = a.min(b);
    }
    out
}

#[inline(always)]
fn max(a: &Lanes, b: &Lanes) -> Lanes {
    let mut out = [0; LANES];
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = a.max(b);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    /// The definition, read off the module's comment.
    fn naive_is_corner(image: &Gray, x: i64, y: i64, threshold: i32) -> bool {
        let value = |(dx, dy): (i32, i32)| {
            i32::from(*image.get(x + i64::from(dx), y + i64::from(dy)).expect("inside"))
        };
        let centre = value((0, 0));
        (0..16).any(|start| {
            let mut arc = (0..9).map(|i| value(CIRCLE[(start + i) % 16]) - centre);
            let mut dark_arc = arc.clone();
            arc.all(|difference| difference > threshold) || dark_arc.all(|difference| difference < -threshold)
        })
    }

    fn blobs(width: u32, height: u32, seed: u128) -> Gray {
        let mut random = Pcg64Mcg::new(seed);
        let values: Vec<u8> = (0..24 * 24).map(|_| random.random_range(0..=255)).collect();
        Raster::from_fn(width, height, |x, y| {
            values[((y / 4 % 24) * 24 + x / 4 % 24) as usize] / 2 + (x % 3) as u8
        })
    }

    #[test]
    fn scores_agree_with_the_naive_definition_at_every_threshold() {
        for (width, height, seed) in [(47, 31, 1), (38, 7, 2), (90, 20, 3)] {
            let image = blobs(width, height, seed);
            for threshold in [0, 5, 20, 60] {
                let scores = score_map(&image, threshold);
                for y in 3..height - 3 {
                    for x in 3..width - 3 {
                        let expected = naive_is_corner(&image, x.into(), y.into(), threshold.into());
                        assert_eq!(scores[(x, y)] > 0, expected, "({x}, {y}) at threshold {threshold}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_score_is_the_largest_threshold_plus_one() {
        let image = blobs(47, 31, 9);
        let scores = score_map(&image, 0);
        let mut corners = 0;
        for y in 3..28_u32 {
            for x in 3..44_u32 {
                let score = i32::from(scores[(x, y)]);
                if score > 0 {
                    corners += 1;
                    assert!(naive_is_corner(&image, x.into(), y.into(), score - 1));
                    assert!(!naive_is_corner(&image, x.into(), y.into(), score));
                }
            }
        }
        assert!(corners > 50, "{corners} corners");
    }

    #[test]
    fn equal_neighbours_give_one_corner() {
        let mut scores = Raster::filled(40, 40, 0);
        for (x, y) in [(20, 20), (21, 20), (20, 21), (30, 7)] {
            scores[(x, y)] = 50;
        }
        let found: Vec<_> = local_maxima(&scores, 3).iter().map(|corner| (corner.x, corner.y)).collect();
        assert_eq!(found, [(30, 7), (20, 20)]);
    }

    #[test]
    fn maxima_agree_with_the_definition_at_every_width() {
        let mut random = Pcg64Mcg::new(17);
        for width in 7..110 {
            // few values, so that neighbours are often equal
            let scores = Raster::from_fn(width, 9, |_, _| random.random_range(0_u8..6));
            let found: Vec<_> = local_maxima(&scores, 3).iter().map(|c| (c.x, c.y, c.score)).collect();
            let row = |y: u32| scores.row(y);
            let places = (3..6_u32).flat_map(|y| (3..width - 3).map(move |x| (x, y)));
            let expected: Vec<_> = places
                .filter(|&(x, y)| is_maximum([row(y - 1), row(y), row(y + 1)], x as usize))
                .map(|(x, y)| (x, y, scores[(x, y)]))
                .collect();
            assert_eq!(found, expected, "width {width}");
        }
    }

    #[test]
    fn images_too_small_for_a_circle_have_no_corners() {
        for (width, height) in [(1, 1), (6, 100), (37, 30), (100, 6)] {
            let scores = score_map(&blobs(width, height, 4), 1);
            assert!(local_maxima(&scores, 3).is_empty());
        }
    }
}
