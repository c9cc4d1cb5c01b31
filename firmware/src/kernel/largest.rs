//! The largest of some magnitudes, to half an octave.

/// Which magnitudes are among the `KEPT` largest: those whose half octave is above a bound, and the
/// first of those that reach it.
pub(super) struct Largest<const KEPT: usize> {
    counts: [u8; STEPS],
    bound: u32,
    /// How many at the bound are still kept.
    left: u8,
}

/// Half octaves from one half on that are told apart: more than 16 bits have.
const STEPS: usize = 40;

impl<const KEPT: usize> Largest<KEPT> {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self {
            counts: [0; STEPS],
            bound: 0,
            left: 0,
        }
    }

    /// Half octaves of a magnitude above one half; none below it.
    #[inline]
    pub fn step(magnitude: f32) -> u8 {
        const HALF: u32 = 0.5_f32.to_bits();
        (magnitude.to_bits().saturating_sub(HALF) >> 22).min(STEPS as u32 - 1) as u8
    }

    /// Sees one of the magnitudes, at most 255.
    #[inline]
    pub fn see(&mut self, step: u8) {
        if let Some(count) = self.counts.get_mut(usize::from(step)) {
            *count = count.wrapping_add(1);
        }
    }

    /// Sets the bound, after all have been seen.
    pub fn decide(&mut self) {
        (self.bound, self.left) = (STEPS as u32, KEPT as u8);
        for &count in self.counts.iter().rev() {
            self.bound -= 1;
            if count > self.left {
                return;
            }
            self.left -= count;
        }
        // All of them.
        self.left = KEPT as u8;
    }

    /// Whether the next one is kept; they come in the same order.
    #[inline]
    pub fn keeps(&mut self, step: u8) -> bool {
        let at_bound = u32::from(step) == self.bound && self.left > 0;
        self.left -= u8::from(at_bound);
        u32::from(step) > self.bound || at_bound
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::seeded;
    use rand_core::Rng;
    use std::vec::Vec;

    #[test]
    fn as_many_are_kept_as_asked_and_none_is_smaller_than_one_left_out() {
        let mut rng = seeded(12);
        for count in [0, 1, 7, 8, 9, 40, 64] {
            let magnitudes: Vec<f32> = (0..count)
                .map(|_| (rng.next_u32() % 32_768) as f32 * (rng.next_u32() % 2) as f32)
                .collect();
            let steps: Vec<u8> = magnitudes.iter().map(|&x| Largest::<8>::step(x)).collect();
            let mut largest = Largest::<8>::new();
            for &step in &steps {
                largest.see(step);
            }
            largest.decide();
            let (kept, out): (Vec<u8>, Vec<u8>) =
                steps.iter().partition(|&&step| largest.keeps(step));
            assert_eq!(kept.len(), count.min(8));
            let least = kept.iter().min().copied().unwrap_or(0);
            assert!(out.iter().all(|&step| step <= least));
        }
    }

    #[test]
    fn a_step_is_half_an_octave() {
        for (magnitude, step) in [
            (0.0, 0),
            (0.7, 0),
            (0.75, 1),
            (1.0, 2),
            (1.4, 2),
            (3.0, 5),
            (32_767.0, 31),
            (1e9, 39),
            (f32::NAN, 39),
        ] {
            assert_eq!(Largest::<1>::step(magnitude), step, "{magnitude}");
        }
    }
}
