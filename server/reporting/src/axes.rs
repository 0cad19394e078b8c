//! Ranges of values for plots and colours.

/// The smallest interval around values, with a margin on both sides; `[0, 1]` of nothing.
pub(crate) fn around(values: impl Iterator<Item = f64>, margin_share: f64) -> [f64; 2] {
    let finite = values.filter(|value| value.is_finite());
    let bounds = finite.fold(None, |bounds: Option<[f64; 2]>, value| {
        Some(bounds.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
    });
    let Some([low, high]) = bounds else { return [0.0, 1.0] };
    let margin = ((high - low) * margin_share).max(high.abs().max(1e-3) * 1e-3);
    [low - margin, high + margin]
}

/// Two intervals of different middles widened to one scale for an area of `width` by `height`.
pub(crate) fn to_one_scale([x, y]: [[f64; 2]; 2], (width, height): (f64, f64)) -> [[f64; 2]; 2] {
    let per_px = ((x[1] - x[0]) / width).max((y[1] - y[0]) / height);
    let widened = |[low, high]: [f64; 2], px: f64| {
        let middle = (low + high) / 2.0;
        [middle - per_px * px / 2.0, middle + per_px * px / 2.0]
    };
    [widened(x, width), widened(y, height)]
}

/// The values below which 2 % and 98 % lie.
pub(crate) fn most_of(mut values: Vec<f64>) -> [f64; 2] {
    values.retain(|value| value.is_finite());
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| {
        let place = (share * values.len().saturating_sub(1) as f64).round() as usize;
        values.get(place).copied().unwrap_or(0.0)
    };
    [at(0.02), at(0.98)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_and_one_value_have_an_interval_too() {
        assert_eq!(around([].into_iter(), 0.1), [0.0, 1.0]);
        let [low, high] = around([5.0, f64::NAN].into_iter(), 0.1);
        assert!(low < 5.0 && high > 5.0);
        assert_eq!(most_of(vec![f64::NAN]), [0.0, 0.0]);
    }

    #[test]
    fn one_scale_keeps_both_intervals_inside() {
        let [x, y] = to_one_scale([[0.0, 4.0], [0.0, 1.0]], (100.0, 100.0));
        assert_eq!((x, y), ([0.0, 4.0], [-1.5, 2.5]));
    }
}
