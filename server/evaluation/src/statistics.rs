//! What is told about a set of errors.

use serde::Serialize;

/// Metres to the millimetres that people read.
pub(crate) const MM_PER_M: f64 = 1000.0;

/// Mean, median, root mean square and 95 % quantile of errors in one unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Arithmetic mean.
    pub mean: f64,
    /// Half lie below.
    pub median: f64,
    /// Root mean square.
    pub rmse: f64,
    /// 95 % lie below, interpolated between neighbours.
    pub p95: f64,
    /// How many.
    pub n: usize,
}

impl Statistics {
    /// `None` of nothing.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        let n = values.len();
        if n == 0 {
            return None;
        }
        values.sort_unstable_by(f64::total_cmp);
        let count = n as f64;
        let mean = values.iter().sum::<f64>() / count;
        let rmse = mean_square(&values).sqrt();
        Some(Self { mean, median: quantile(&values, 0.5), rmse, p95: quantile(&values, 0.95), n })
    }
}

/// Mean of the squares; NaN of nothing.
pub(crate) fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
}

/// The quantile of sorted, non-empty values, linear between neighbours.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = (sorted.len() - 1) as f64 * share;
    let below = place as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_numpy() {
        // np.quantile([3, 1, 4, 1, 5, 9, 2, 6], .95) and np.median of the same.
        let s = Statistics::of(vec![3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0]).expect("eight values");
        assert!((s.p95 - 7.95).abs() < 1e-12 && (s.median - 3.5).abs() < 1e-12, "{s:?}");
        assert!((s.mean - 3.875).abs() < 1e-12 && (s.rmse - 4.650268809434569).abs() < 1e-12, "{s:?}");
    }

    #[test]
    fn nothing_has_no_statistics() {
        assert_eq!(Statistics::of(Vec::new()), None);
    }
}
