//! When a flight is not tracked, though the filter answers at every step.
//!
//! A step is not tracked if its estimate was refused or unusable, or if the filter rejected or
//! started anew from more than half of its last ten readings, gaps left out: such a filter follows
//! its readings one by one, or none of them. Only methods with a gate tell; of the others (the
//! paper's EKF and UKF, rules) nothing but refusals is known.

use std::collections::VecDeque;

use crate::filter::{Fate, FilterError, PositionEstimate};

/// Readings that are looked back at.
const LOOK_BACK: usize = 10;

/// The last readings of a flight, and what became of them.
#[derive(Clone, Debug, Default)]
pub struct Loss {
    unused: VecDeque<bool>,
}

impl Loss {
    /// Takes note of an answer, which was `usable` or not; whether its step is not tracked.
    pub fn step(&mut self, answer: &Result<PositionEstimate, FilterError>, usable: bool) -> bool {
        if let Ok(PositionEstimate {
            fate: Some(fate), ..
        }) = answer
        {
            if self.unused.len() == LOOK_BACK {
                self.unused.pop_front();
            }
            self.unused.push_back(*fate != Fate::Used);
        }
        let unused = self.unused.iter().filter(|unused| **unused).count();
        !usable || 2 * unused > LOOK_BACK
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::Loss;
    use crate::filter::{Fate, FilterError, PositionEstimate};

    fn answer(fate: Option<Fate>) -> Result<PositionEstimate, FilterError> {
        Ok(PositionEstimate {
            position_m: Vector3::zeros(),
            covariance_m2: Matrix3::identity(),
            nis: None,
            fate,
            outside: false,
        })
    }

    #[test]
    fn more_than_half_of_the_last_ten_readings_decide() {
        let mut loss = Loss::default();
        let unused = [Fate::Rejected, Fate::Restarted];
        for k in 0..5 {
            assert!(!loss.step(&answer(Some(unused[k % 2])), true), "{k}");
        }
        assert!(
            loss.step(&answer(Some(Fate::Restarted)), true),
            "six of six"
        );
        // Time alone changes nothing, used readings do once the bad ones are far enough back.
        assert!(loss.step(&answer(None), true));
        for _ in 0..4 {
            assert!(loss.step(&answer(Some(Fate::Used)), true), "six of ten");
        }
        assert!(!loss.step(&answer(Some(Fate::Used)), true), "five of ten");
    }

    #[test]
    fn a_refusal_is_not_tracked_by_itself() {
        let mut loss = Loss::default();
        assert!(loss.step(&Err(FilterError::NotFinite), false));
        assert!(!loss.step(&answer(Some(Fate::Used)), true));
    }
}
