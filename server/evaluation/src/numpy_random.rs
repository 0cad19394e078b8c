//! The draws of `numpy.random.default_rng(0)`, so that both scorers sample the same points of the true surface.

use rand_pcg::Lcg128Xsl64;
use rand_pcg::rand_core::Rng;

/// `numpy.random.SeedSequence(0).generate_state(4, numpy.uint64)`: two words of state, two of stream.
const SEED_ZERO: (u128, u128) =
    (0xdb2c_d7e7_b0f4_78be_abf4_641a_2c71_ba49, 0x20c6_ed6d_9d7b_8d41_2c40_99de_223c_39d4);

/// numpy's `Generator` over PCG64.
pub(crate) struct NumpyRandom {
    bits: Lcg128Xsl64,
    /// The upper half of the last 64-bit draw that was asked for 32 bits.
    spare: Option<u32>,
}

impl NumpyRandom {
    /// `default_rng(0)`.
    pub(crate) fn seeded_zero() -> Self {
        Self { bits: Lcg128Xsl64::new(SEED_ZERO.0, SEED_ZERO.1), spare: None }
    }

    /// `random()`: uniform in `[0, 1)`, 53 bits.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.bits.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// `choice(len(weights), count, p=weights / weights.sum())`; empty where no weight is positive.
    pub(crate) fn choose_weighted(&mut self, weights: &[f64], count: usize) -> Vec<usize> {
        let total: f64 = weights.iter().sum();
        if total.is_nan() || total <= 0.0 {
            return Vec::new();
        }
        let mut sum = 0.0;
        let cumulative: Vec<f64> = weights
            .iter()
            .map(|weight| {
                sum += weight / total;
                sum
            })
            .collect();
        let draw = |_| {
            let uniform = self.uniform();
            cumulative.partition_point(|&below| below / sum <= uniform)
        };
        (0..count).map(draw).collect()
    }

    /// `choice(population, count, replace=False)` for more than 10,000, of which more than a fiftieth is chosen:
    /// the tail of a shuffle.
    pub(crate) fn choose_distinct(&mut self, population: u32, count: u32) -> Vec<u32> {
        let mut all: Vec<u32> = (0..population).collect();
        let first = population.saturating_sub(count);
        for i in (first.max(1)..population).rev() {
            let other = self.below_or_at(i);
            all.swap(i as usize, other as usize);
        }
        all.split_off(first as usize)
    }

    /// Uniform in `0..=last` by Lemire's method, on 32 bits as numpy draws them.
    fn below_or_at(&mut self, last: u32) -> u32 {
        let range = u64::from(last) + 1;
        let threshold = ((1u64 << 32) - range) % range;
        loop {
            let product = u64::from(self.bits32()) * range;
            if product & u64::from(u32::MAX) >= threshold {
                return (product >> 32) as u32;
            }
        }
    }

    fn bits32(&mut self) -> u32 {
        self.spare.take().unwrap_or_else(|| {
            let both = self.bits.next_u64();
            self.spare = Some((both >> 32) as u32);
            both as u32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Each expectation is what numpy 2.4.6 gives for the call named, on a fresh default_rng(0).

    #[test]
    fn uniform_draws_are_those_of_numpy() {
        let mut random = NumpyRandom::seeded_zero();
        for expected in [0.63696169, 0.26978671, 0.04097352] {
            assert!((random.uniform() - expected).abs() < 5e-9);
        }
    }

    #[test]
    fn weighted_choices_are_those_of_numpy() {
        let mut random = NumpyRandom::seeded_zero();
        let chosen = random.choose_weighted(&[1.0, 2.0, 3.0, 4.0, 0.0, 5.0], 12);
        assert_eq!(chosen, [3, 2, 0, 0, 5, 5, 3, 5, 3, 5, 5, 0]);
        assert!((random.uniform() - 0.85740428).abs() < 5e-9);
    }

    #[test]
    fn distinct_choices_are_those_of_numpy() {
        let mut random = NumpyRandom::seeded_zero();
        let chosen = random.choose_distinct(20_000, 15_000);
        assert_eq!(chosen[..8], [19445, 3758, 873, 14393, 9426, 16932, 9329, 9151]);
        assert_eq!(chosen[14_995..], [6155, 5394, 10221, 12738, 17012]);
        assert!((random.uniform() - 0.5281270014102099).abs() < 1e-15);
    }

    #[test]
    fn weights_of_nothing_choose_nothing() {
        let mut random = NumpyRandom::seeded_zero();
        assert_eq!(random.choose_weighted(&[0.0, 0.0], 3), Vec::<usize>::new());
        assert_eq!(random.choose_weighted(&[f64::NAN], 3), Vec::<usize>::new());
    }
}
