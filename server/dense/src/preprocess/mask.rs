//! Instrument masks with a margin: beside an instrument's edge, windows of the matcher take in both it and the tissue.

use geometry::Mask;

/// Covers all pixels within `margin_px` of a covered one along rows and columns (a square).
pub(super) fn widened(mask: &Mask, margin_px: u32) -> Mask {
    let (width, height) = mask.size();
    let reach = i64::from(margin_px);
    let covers = |mask: &Mask, x: i64, y: i64| mask.get(x, y).is_some_and(|&covered| covered != 0);
    let along_rows = spread(width, height, |x, y| covers(mask, x, y), |x, y, step| (x + step, y), reach);
    spread(width, height, |x, y| covers(&along_rows, x, y), |x, y, step| (x, y + step), reach)
}

fn spread(
    width: u32,
    height: u32,
    covers: impl Fn(i64, i64) -> bool,
    beside: impl Fn(i64, i64, i64) -> (i64, i64),
    reach: i64,
) -> Mask {
    Mask::from_fn(width, height, |x, y| {
        let near = (-reach..=reach).any(|step| {
            let (x, y) = beside(i64::from(x), i64::from(y), step);
            covers(x, y)
        });
        u8::from(near)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_grows_by_its_margin_and_not_over_the_border() {
        let mask = Mask::from_fn(9, 7, |x, y| if (x, y) == (1, 4) { 255 } else { 0 });
        let wide = widened(&mask, 2);
        let covered = |x: u32, y: u32| x <= 3 && (2..=6).contains(&y);
        for y in 0..7 {
            for x in 0..9 {
                assert_eq!(wide[(x, y)] != 0, covered(x, y), "{x} {y}");
            }
        }
        assert_eq!(widened(&mask, 0).map(|&covered| covered != 0), mask.map(|&covered| covered != 0));
    }
}
