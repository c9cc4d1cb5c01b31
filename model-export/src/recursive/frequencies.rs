//! How often the targets of own flights do what the network does not expect.
//!
//! The posterior of the manoeuvres' frequencies under a Dirichlet prior at the shipped ones, found by a
//! few rounds of expectation and maximisation: the filter runs over own encounters, and its soft counts
//! become the next prior. How often readings are wrong stays as it was: theirs were simulated.

use super::batch::Batch;
use super::carry::Carry;
use super::encounter::Encounter;
use super::model::RecursiveModel;
use super::network::sampling::Sampling;
use super::network::weights::Weights;
use super::score::WINDOW;
use super::step::Weighing;
use super::step_programs::Programs;
use super::unrolled::Unrolled;
use crate::autodiff::lanes::LANES;
use crate::kernel::Tier;
use bnkf::recursive::hypotheses::{HYPOTHESES, Hypotheses};
use rayon::prelude::*;

/// Steps that the shipped frequencies count for: ten flights of 150.
const CONFIDENCE: f64 = 1500.0;
/// Most that a frequency becomes, in the shipped one: a model that needs more of them is no model.
const TIMES_MAX: f64 = 10.0;
/// Rounds; the frequencies change by less than a tenth in later ones.
const ROUNDS: usize = 3;

/// The model's hypotheses with manoeuvres as often as `encounters` have them.
pub fn learned(model: &RecursiveModel, encounters: &[Encounter]) -> Hypotheses<f64> {
    let shipped = model.parameters.hypotheses;
    let mut parameters = model.parameters;
    let weights = model.network.weights(Tier::detect(), Sampling::Nothing);
    for _ in 0..ROUNDS {
        let programs = Programs::new(&parameters, &model.normalisation, Weighing::All);
        let counts = encounters
            .par_chunks(2 * LANES)
            .map(|chunk| counts(&programs, &weights, chunk))
            .collect::<Vec<_>>();
        let mut total = [0.0; HYPOTHESES];
        for counts in counts {
            for (sum, count) in total.iter_mut().zip(counts) {
                *sum += count;
            }
        }
        parameters.hypotheses = posterior(&shipped, &total);
    }
    parameters.hypotheses
}

/// How often each hypothesis held in a few groups of encounters.
fn counts(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> [f64; HYPOTHESES] {
    let batches = Batch::groups_alike(encounters);
    let mut run = Unrolled::new(programs, batches.len(), WINDOW, 0.0);
    run.whole(weights, &batches, |_, _, _| ());
    let mut counts = [0.0; HYPOTHESES];
    for (group, batch) in batches.iter().enumerate() {
        for lane in 0..batch.used {
            let flat = run.carry(0, group).iter().map(|number| number[lane]);
            let carry = Carry::unflatten(&flat.collect::<Vec<f64>>());
            for (sum, count) in counts.iter_mut().zip(carry.memory.counts) {
                *sum += count;
            }
        }
    }
    counts
}

/// The shipped hypotheses with the manoeuvres' frequencies that `counts` make of them.
fn posterior(shipped: &Hypotheses<f64>, counts: &[f64; HYPOTHESES]) -> Hypotheses<f64> {
    let prior = Hypotheses {
        confidence: CONFIDENCE,
        ..*shipped
    };
    let odds = prior.odds(counts);
    let mut learned = *shipped;
    for (manoeuvre, odds) in learned.manoeuvres.iter_mut().zip(&odds[1..]) {
        manoeuvre.prior = odds.min(TIMES_MAX * manoeuvre.prior);
    }
    learned
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::network::Network;
    use crate::recursive::normalisation::Normalisation;
    use crate::recursive::unrolled::tests::unequal;
    use bnkf::recursive::parameters::Parameters;

    #[test]
    fn a_longer_group_is_counted_to_its_end() {
        let programs = Programs::new(&Parameters::PAPER, &Normalisation::IDENTITY, Weighing::All);
        let weights = Network::new(7).weights(Tier::detect(), Sampling::Nothing);
        let encounters = unequal(LANES + 1);
        let together = counts(&programs, &weights, &encounters);
        let mut alone = [0.0; HYPOTHESES];
        for encounter in encounters.chunks(1) {
            let counts = counts(&programs, &weights, encounter);
            for (sum, count) in alone.iter_mut().zip(counts) {
                *sum += count;
            }
        }
        for (together, alone) in together.into_iter().zip(alone) {
            assert!((together / alone - 1.0).abs() < 1e-9, "{together} {alone}");
        }
    }

    #[test]
    fn counts_move_the_manoeuvres_and_nothing_else() {
        let shipped = Hypotheses::DRONE;
        assert_eq!(posterior(&shipped, &[0.0; HYPOTHESES]), shipped);
        let learned = posterior(&shipped, &[1400.0, 80.0, 10.0, 10.0]);
        let [burst, jump] = learned.manoeuvres.map(|m| m.prior);
        assert!((burst - 87.5 / 3000.0).abs() < 1e-12, "{burst}");
        assert!((jump - 10.75 / 3000.0).abs() < 1e-12, "{jump}");
        let most = posterior(&shipped, &[0.0, 0.0, 1e6, 0.0]).manoeuvres[1].prior;
        assert!((most - 5e-3).abs() < 1e-12, "{most}");
        let mut back = learned;
        for (manoeuvre, shipped) in back.manoeuvres.iter_mut().zip(shipped.manoeuvres) {
            manoeuvre.prior = shipped.prior;
        }
        assert_eq!(back, shipped);
    }
}
