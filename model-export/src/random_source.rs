//! Uniform and Gaussian numbers in f64 for the host: flights, sensor noise, initial weights.
//!
//! Logarithms come from `libm`, not from the platform, so a seed gives the same numbers on every
//! machine. Nothing here panics for finite arguments.

use crate::seed;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A seeded stream of random numbers (xoshiro256++).
#[derive(Clone, Debug)]
pub struct RandomSource {
    generator: Xoshiro256PlusPlus,
    /// The polar method makes normal numbers in pairs; the second waits here.
    spare_normal: Option<f64>,
}

impl RandomSource {
    /// The stream that `ids` name under `seed`; see [`seed::derive`].
    #[must_use]
    pub fn new(seed: u64, ids: &[u64]) -> Self {
        Self {
            generator: Xoshiro256PlusPlus::seed_from_u64(seed::derive(seed, ids)),
            spare_normal: None,
        }
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.generator.next_u64()
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        const SCALE: f64 = 1.0 / (1u64 << 53) as f64;
        (self.bits() >> 11) as f64 * SCALE
    }

    /// Uniform between `low` and `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// True with the given probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// +1 or -1 with equal probability.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Uniform in `0..bound`; 0 when `bound` is 0 or 1.
    pub fn below(&mut self, bound: usize) -> usize {
        // Multiply-shift: the bias is below bound / 2^64.
        ((u128::from(self.bits()) * bound as u128) >> 64) as usize
    }

    /// Permutes `items` uniformly (Fisher-Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last + 1));
        }
    }

    /// Standard normal, by Marsaglia's polar method.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        loop {
            let x = self.uniform(-1.0, 1.0);
            let y = self.uniform(-1.0, 1.0);
            let s = x * x + y * y;
            if s > 0.0 && s < 1.0 {
                let factor = (-2.0 * libm::log(s) / s).sqrt();
                self.spare_normal = Some(y * factor);
                return x * factor;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::RandomSource;

    const DRAWS: usize = 200_000;

    #[test]
    fn normal_has_the_moments_and_tails_of_a_standard_normal() {
        let mut source = RandomSource::new(1, &[]);
        let draws: Vec<f64> = (0..DRAWS).map(|_| source.normal()).collect();
        let n = DRAWS as f64;
        let moment = |power| draws.iter().map(|x| f64::powi(*x, power)).sum::<f64>() / n;
        // Five standard errors of each moment: sqrt(1, 2, 15, 96) / sqrt(n).
        assert!(moment(1).abs() < 5.0 * (1.0 / n).sqrt());
        assert!((moment(2) - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        assert!(moment(3).abs() < 5.0 * (15.0 / n).sqrt());
        assert!((moment(4) - 3.0).abs() < 5.0 * (96.0 / n).sqrt());
        let beyond = draws.iter().filter(|x| x.abs() > 1.959_964).count() as f64 / n;
        assert!((beyond - 0.05).abs() < 5.0 * (0.05 * 0.95 / n).sqrt());
    }

    #[test]
    fn the_two_normals_of_a_pair_are_uncorrelated() {
        let mut source = RandomSource::new(2, &[]);
        let sum: f64 = (0..DRAWS).map(|_| source.normal() * source.normal()).sum();
        assert!((sum / DRAWS as f64).abs() < 5.0 / (DRAWS as f64).sqrt());
    }

    #[test]
    fn uniform_fills_its_interval_evenly() {
        let mut source = RandomSource::new(3, &[]);
        let mut counts = [0_u32; 10];
        for _ in 0..DRAWS {
            let value = source.uniform(-2.0, 3.0);
            assert!((-2.0..3.0).contains(&value));
            counts[((value + 2.0) * 2.0) as usize] += 1;
        }
        let expected = DRAWS as f64 / 10.0;
        let chi2: f64 = counts
            .iter()
            .map(|count| (f64::from(*count) - expected).powi(2) / expected)
            .sum();
        // 99.9% point of chi-square with nine degrees of freedom.
        assert!(chi2 < 27.9, "chi-square {chi2}");
    }

    #[test]
    fn below_and_shuffle_reach_every_outcome() {
        let mut source = RandomSource::new(4, &[]);
        assert_eq!(source.below(0), 0);
        let mut first_places = [0_u32; 5];
        for _ in 0..5000 {
            let mut items = [0, 1, 2, 3, 4];
            source.shuffle(&mut items);
            first_places[items[0]] += 1;
            items.sort_unstable();
            assert_eq!(items, [0, 1, 2, 3, 4]);
        }
        for count in first_places {
            assert!((850..1150).contains(&count), "{first_places:?}");
        }
    }

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, ids: &[u64]| {
            let mut source = RandomSource::new(seed, ids);
            [source.normal(), source.normal(), source.unit()]
        };
        assert_eq!(draw(5, &[1, 2]), draw(5, &[1, 2]));
        assert_ne!(draw(5, &[1, 2]), draw(5, &[2, 1]));
        assert_ne!(draw(5, &[1, 2]), draw(6, &[1, 2]));
    }
}
