//! Matches between two whole sets of descriptors, when no pose tells where to look.

use crate::dispatch::dispatch;
use crate::feature::Descriptor;

/// Best and second best seen so far for one descriptor.
#[derive(Clone, Copy)]
struct Nearest {
    best: u32,
    second: u32,
    index: usize,
}

const NOTHING: Nearest = Nearest { best: u32::MAX, second: u32::MAX, index: usize::MAX };

impl Nearest {
    #[inline(always)]
    fn see(&mut self, distance: u32, index: usize) {
        if distance < self.best {
            *self = Self { best: distance, second: self.best, index };
        } else {
            self.second = self.second.min(distance);
        }
    }
}

dispatch! {
    /// Pairs `(index in a, index in b)` that are each other's nearest, at most `distance_max_bits` apart and nearer than
    /// `ratio` times the second nearest; in the order of `a`.
    pub fn mutual_matches(a: &[Descriptor], b: &[Descriptor], distance_max_bits: u32, ratio: f32) -> Vec<(usize, usize)> = mutual_matches_portable;
}

#[inline(always)]
fn mutual_matches_portable(
    a: &[Descriptor],
    b: &[Descriptor],
    distance_max_bits: u32,
    ratio: f32,
) -> Vec<(usize, usize)> {
    let mut nearest_in_a = vec![NOTHING; b.len()];
    let nearest_in_b: Vec<Nearest> = a
        .iter()
        .enumerate()
        .map(|(i, descriptor)| {
            let mut nearest = NOTHING;
            for (j, other) in b.iter().enumerate() {
                let distance = descriptor.distance(other);
                nearest.see(distance, j);
                nearest_in_a[j].see(distance, i);
            }
            nearest
        })
        .collect();
    let accepted = |(i, nearest): (usize, &Nearest)| {
        let distinct =
            nearest.best <= distance_max_bits && (nearest.best as f32) < ratio * nearest.second as f32;
        (distinct && nearest_in_a[nearest.index].index == i).then_some((i, nearest.index))
    };
    nearest_in_b.iter().enumerate().filter_map(accepted).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn a_shuffled_noisy_copy_is_matched_and_strangers_are_not() {
        let mut random = Pcg64Mcg::new(3);
        let a: Vec<Descriptor> = (0..100).map(|_| Descriptor(random.random())).collect();
        let mut b: Vec<Descriptor> = a[..80].iter().rev().copied().collect();
        for descriptor in &mut b {
            for _ in 0..20 {
                descriptor.0[random.random_range(0..4)] ^= 1 << random.random_range(0..64);
            }
        }
        b.extend((0..30).map(|_| Descriptor(random.random())));
        let expected: Vec<(usize, usize)> = (0..80).map(|i| (i, 79 - i)).collect();
        assert_eq!(mutual_matches(&a, &b, 60, 0.8), expected);
    }

    #[test]
    fn twins_are_ambiguous() {
        let a = [Descriptor([7; 4])];
        assert!(mutual_matches(&a, &[Descriptor([7; 4]), Descriptor([7; 4])], 60, 0.8).is_empty());
    }

    #[test]
    fn nothing_matches_nothing() {
        assert!(mutual_matches(&[], &[Descriptor([0; 4])], 60, 0.8).is_empty());
        assert!(mutual_matches(&[Descriptor([0; 4])], &[], 60, 0.8).is_empty());
    }
}
