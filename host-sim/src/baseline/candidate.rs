//! A second track beside the first of a gated filter: [`bnkf::recursive::candidate`] for any filter.
//!
//! Rule and figures are the firmware's. Start and motion are the filter's own, where the firmware's
//! candidate is readier for fast targets than its track.

use bnkf::recursive::AGREEING;
use bnkf::recursive::candidate::{AGE_MAX_S, AGREEMENT_NIS, MISSES_MAX};
use bnkf_model_export::radar::reading::Reading;
use nalgebra::Vector3;

use crate::filter::{Filter, FilterError, PositionEstimate, Start};

/// A filter under way.
#[derive(Clone, Debug)]
pub struct Track<F> {
    /// The filter, started.
    pub filter: F,
    /// Time of its last step, microseconds.
    pub time_us: u64,
    /// Readings that it was corrected with, the first one included.
    pub used: u32,
}

impl<F: Filter> Track<F> {
    /// The track one step later, if `time_us` is the time of `reading`.
    ///
    /// # Errors
    /// The filter's.
    pub fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let estimate = self.filter.step(time_us, reading)?;
        self.time_us = time_us;
        self.used += u32::from(reading.is_some());
        Ok(estimate)
    }
}

/// A track that may take over.
#[derive(Clone, Debug)]
pub struct Candidate<F> {
    track: Track<F>,
    agreeing: u8,
    misses: u8,
}

/// What a rejected reading did to the candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The candidate is too old, too unsure or too often contradicted to go on with.
    Over,
    /// Nothing is certain yet.
    Wait,
    /// The candidate has had enough agreement; its estimate.
    Agreed(PositionEstimate),
}

impl<F: Filter + Clone> Candidate<F> {
    /// A candidate of `filter`'s kind from its first reading, if a track can start from it.
    pub fn start(filter: &F, reading: &Reading) -> Option<Self> {
        let mut filter = filter.clone();
        let nowhere = Vector3::repeat(f64::NAN);
        let start = Start {
            reading,
            // Nobody knows the truth when a filter starts anew.
            true_position_m: nowhere,
            true_velocity_mps: nowhere,
        };
        filter.start(&start).ok()?;
        Some(Self {
            track: Track {
                filter,
                time_us: reading.time_us,
                used: 1,
            },
            agreeing: 1,
            misses: 0,
        })
    }

    /// A track that was replaced.
    pub fn deposed(track: Track<F>) -> Self {
        Self {
            track,
            agreeing: 0,
            misses: 0,
        }
    }

    /// The track.
    pub fn track(&self) -> &Track<F> {
        &self.track
    }

    /// The track, with which the candidate ends.
    pub fn into_track(self) -> Track<F> {
        self.track
    }

    /// Compares a reading with the candidate, and takes it in if it agrees. A candidate whose
    /// position is unsure by more than `unsure_max_m` agrees with nothing.
    pub fn meet(&mut self, reading: &Reading, unsure_max_m: f64) -> Verdict {
        let elapsed_us = reading.time_us.saturating_sub(self.track.time_us);
        if elapsed_us as f64 * 1e-6 > f64::from(AGE_MAX_S) {
            return Verdict::Over;
        }
        let coasted = self.track.filter.clone().step(reading.time_us, None);
        if coasted.is_ok_and(|at| at.covariance_m2.trace() > unsure_max_m * unsure_max_m) {
            return Verdict::Over;
        }
        let mut moved = self.track.clone();
        let estimate = match moved.step(reading.time_us, Some(reading)) {
            Ok(estimate) if estimate.nis_is_below(f64::from(AGREEMENT_NIS)) => estimate,
            _ => {
                self.misses += 1;
                return if self.misses < MISSES_MAX {
                    Verdict::Wait
                } else {
                    Verdict::Over
                };
            }
        };
        self.track = moved;
        self.misses = 0;
        self.agreeing = self.agreeing.saturating_add(1);
        if self.agreeing >= AGREEING {
            Verdict::Agreed(estimate)
        } else {
            Verdict::Wait
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Candidate, Verdict};
    use crate::baseline::gated::tests::reading;
    use crate::baseline::imm::Imm;
    use crate::baseline::origin::Origin;
    use crate::baseline::prior::tests::PRIOR;

    const UNSURE_MAX_M: f64 = 12.0;

    fn candidate() -> Candidate<Imm<10>> {
        let filter = Imm::wide(Origin::Population(PRIOR));
        Candidate::start(&filter, &reading(0, 0.5)).expect("a usable reading")
    }

    fn waits(verdict: Verdict) -> bool {
        verdict == Verdict::Wait
    }

    #[test]
    fn three_that_agree_are_enough() {
        let mut candidate = candidate();
        assert!(waits(candidate.meet(&reading(100_000, 0.5), UNSURE_MAX_M)));
        let third = candidate.meet(&reading(200_000, 0.5), UNSURE_MAX_M);
        let Verdict::Agreed(estimate) = third else {
            panic!("{third:?}");
        };
        let track = candidate.into_track();
        assert_eq!((track.used, track.time_us), (3, 200_000));
        let bearing_rad = estimate.position_m.y.atan2(estimate.position_m.x);
        assert!((bearing_rad - 0.5).abs() < 0.02, "{bearing_rad}");
    }

    #[test]
    fn two_in_a_row_elsewhere_end_it_and_one_does_not() {
        let mut candidate = candidate();
        let mut meet = |time_us, azimuth_rad| {
            let met = reading(time_us, azimuth_rad);
            candidate.meet(&met, UNSURE_MAX_M)
        };
        assert!(waits(meet(100_000, -2.0)));
        assert!(waits(meet(200_000, 0.5)));
        assert!(waits(meet(300_000, -2.0)));
        assert_eq!(meet(400_000, 2.5), Verdict::Over);
    }

    #[test]
    fn what_is_old_or_unsure_agrees_with_nothing() {
        let wide_m = 1e6;
        assert_eq!(
            candidate().meet(&reading(5_100_000, 0.5), wide_m),
            Verdict::Over
        );
        assert!(waits(candidate().meet(&reading(4_900_000, 0.5), wide_m)));
        assert_eq!(candidate().meet(&reading(100_000, 0.5), 0.1), Verdict::Over);
    }

    #[test]
    fn a_deposed_track_needs_three_again() {
        let mut old = Candidate::deposed(candidate().into_track());
        for time_us in [100_000, 200_000] {
            assert!(waits(old.meet(&reading(time_us, 0.5), UNSURE_MAX_M)));
        }
        let third = old.meet(&reading(300_000, 0.5), UNSURE_MAX_M);
        assert!(matches!(third, Verdict::Agreed(_)), "{third:?}");
        assert_eq!(old.track().used, 4);
    }
}
