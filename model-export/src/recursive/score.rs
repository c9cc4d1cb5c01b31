//! How well a network tracks a set of encounters.

use super::batch::Batch;
use super::carry::Carry;
use super::encounter::Encounter;
use super::network::weights::Weights;
use super::step_programs::Programs;
use super::unrolled::Unrolled;
use crate::autodiff::lanes::LANES;
use crate::scoring::means::{Means, Sums};
use rayon::prelude::*;
use serde::Serialize;

/// Steps that are kept at a time.
pub(super) const WINDOW: usize = 50;

/// Means over every step after the start, gaps included, nothing dropped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Score {
    /// What was found.
    #[serde(flatten)]
    pub means: Means,
    /// Encounters whose state was lost (no longer finite).
    pub lost: usize,
}

impl Score {
    /// Runs `weights` over every encounter.
    pub fn of(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> Self {
        let parts: Vec<(Sums, usize)> = encounters
            .par_chunks(2 * LANES)
            .map(|pair| Self::sums(programs, weights, pair))
            .collect();
        let (sums, lost) = parts.into_iter().fold(
            (Sums::default(), 0),
            |(sums, lost), (part, lost_in_part)| (sums.join(part), lost + lost_in_part),
        );
        Self {
            means: sums.means(),
            lost,
        }
    }

    fn sums(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> (Sums, usize) {
        let batches = Batch::groups_alike(encounters);
        let mut run = Unrolled::new(programs, batches.len(), WINDOW, 0.0);
        let mut sums = Sums::default();
        let loss = run.whole(weights, &batches, |run, at, step| {
            for (group, batch) in batches.iter().enumerate() {
                let lanes = run.carry(at + 1, group);
                for lane in 0..LANES {
                    if batch.weights[step][lane] > 0.0 {
                        let flat: Vec<f64> = lanes.iter().map(|number| number[lane]).collect();
                        let truth = batch.truths_m[step].map(|axis| axis[lane]);
                        sums.add(&Carry::unflatten(&flat).score(truth));
                    }
                }
            }
        });
        (sums, loss.lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Tier;
    use crate::recursive::network::Network;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::normalisation::Normalisation;
    use crate::recursive::step::Weighing;
    use crate::recursive::unrolled::tests::unequal;
    use bnkf::recursive::parameters::Parameters;

    /// Two groups, of which one ends before the other: every step of both counts, as in each alone.
    #[test]
    fn a_longer_group_is_scored_to_its_end() {
        let programs = Programs::new(&Parameters::PAPER, &Normalisation::IDENTITY, Weighing::All);
        let weights = Network::new(7).weights(Tier::detect(), Sampling::Nothing);
        let encounters = unequal(LANES + 1);
        let steps: usize = encounters.iter().map(|e| e.arrivals.len()).sum();
        let steps = steps as u64;
        let together = Score::of(&programs, &weights, &encounters);
        assert_eq!(together.means.steps, steps);
        let (mut distance_m, mut nees) = (0.0, 0.0);
        for encounter in encounters.chunks(1) {
            let alone = Score::of(&programs, &weights, encounter).means;
            distance_m += alone.steps as f64 * alone.distance_m;
            nees += alone.steps as f64 * alone.nees;
        }
        let means = [together.means.distance_m, together.means.nees];
        for (mean, sum) in means.into_iter().zip([distance_m, nees]) {
            assert!((mean * steps as f64 / sum - 1.0).abs() < 1e-9, "{mean}");
        }
    }
}
