//! A figure over time, and how it changes once it has settled.

/// Readings in the order of their times.
#[derive(Debug, Default)]
pub struct Series(Vec<(f64, f64)>);

impl Series {
    /// Takes a reading in.
    pub fn push(&mut self, at_s: f64, value: f64) {
        self.0.push((at_s, value));
    }

    /// The newest reading; not a number before the first.
    pub fn newest(&self) -> f64 {
        self.0.last().map_or(f64::NAN, |&(_, value)| value)
    }

    /// The second half, when what fills up has filled up.
    fn settled(&self) -> &[(f64, f64)] {
        &self.0[self.0.len() / 2..]
    }

    /// Mean of the second half.
    pub fn mean(&self) -> f64 {
        let settled = self.settled();
        settled.iter().map(|&(_, value)| value).sum::<f64>() / settled.len() as f64
    }

    /// Slope of the straight line through the second half (least squares), a minute.
    pub fn slope_per_min(&self) -> f64 {
        let settled = self.settled();
        let mean_s = settled.iter().map(|&(at_s, _)| at_s).sum::<f64>() / settled.len() as f64;
        let mean = self.mean();
        let (mut covariance, mut variance) = (0.0, 0.0);
        for &(at_s, value) in settled {
            covariance += (at_s - mean_s) * (value - mean);
            variance += (at_s - mean_s).powi(2);
        }
        60.0 * covariance / variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fills_up_and_then_rests_is_flat_and_what_leaks_is_not() {
        let (mut filling, mut leaking) = (Series::default(), Series::default());
        for second in 0..600 {
            let at_s = f64::from(second);
            filling.push(at_s, at_s.min(200.0));
            leaking.push(at_s, 50.0 + 0.1 * at_s);
        }
        assert_eq!((filling.slope_per_min(), filling.mean()), (0.0, 200.0));
        assert!((leaking.slope_per_min() - 6.0).abs() < 1e-9);
    }
}
