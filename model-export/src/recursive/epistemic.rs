//! How much the weights' uncertainty says about the motion: the spread of the scheduled jerk over
//! Monte Carlo passes.

use super::features::features;
use super::model::RecursiveModel;
use super::schedule::{OUTPUTS, Schedule};
use super::step::advance;
use super::trial::Cell;
use bnkf::blob::Blob;
use bnkf::monte_carlo::separate_moments;
use bnkf::network::{Network, Scratch};
use bnkf::rng::seeded;
use rayon::prelude::*;
use serde::Serialize;

/// Trials that are enough for a figure.
const TRIALS: usize = 16;
/// First output that is a mean jerk, and its scale to m/s^3; see `firmware/BLOB.md`.
const JERK_OUTPUT: usize = 4;
const JERK_SCALE: f64 = 2.0;

/// Means over axes, steps and trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Epistemic {
    /// Root mean square over steps of the standard deviation of the mean jerk over passes, m/s^3.
    pub jerk_sigma_mps3: f64,
    /// What it adds to the spectral density of the jerk noise, as a share of what the network
    /// schedules: `variance dt / q_j`.
    pub noise_share: f64,
}

/// Follows the first trials of `cell` with mean weights and asks `passes` sampled networks about
/// every step.
pub fn epistemic(model: &RecursiveModel, blob: Blob<'_>, cell: &Cell, passes: u16) -> Epistemic {
    let mut encounters = cell.encounters(&model.population);
    encounters.truncate(TRIALS);
    let sums: Vec<(f64, f64, f64)> = encounters
        .par_iter()
        .enumerate()
        .map(|(index, encounter)| {
            let (mut squares, mut share, mut count) = (0.0, 0.0, 0.0);
            let mut rng = seeded(index as u64);
            let mut scratch = Scratch::new();
            for view in blob.networks() {
                let network = Network::new(view);
                let mut carry = encounter.start;
                for arrival in &encounter.arrivals {
                    let list = features(&carry, arrival.dt_s);
                    let inputs = model.normalisation.apply(&list).map(|x| x as f32);
                    let mut outputs = [0.0_f32; OUTPUTS];
                    network.mean_pass(&inputs, &mut outputs);
                    let outputs = outputs.map(f64::from);
                    let (_, variances): ([f32; OUTPUTS], [f32; OUTPUTS]) =
                        separate_moments(&network, &inputs, passes, &mut rng, &mut scratch);
                    let schedule = Schedule::read(&outputs, &model.base);
                    for axis in 0..3 {
                        let variance = f64::from(variances[JERK_OUTPUT + axis]);
                        let variance = JERK_SCALE * JERK_SCALE * variance;
                        squares += variance;
                        share += variance * arrival.dt_s / schedule.jerk_noise[axis];
                        count += 1.0;
                    }
                    carry = advance(&carry, &outputs, arrival, &model.base);
                }
            }
            (squares, share, count)
        })
        .collect();
    let total = |part: fn(&(f64, f64, f64)) -> f64| sums.iter().map(part).sum::<f64>();
    let count = total(|sum| sum.2);
    Epistemic {
        jerk_sigma_mps3: (total(|sum| sum.0) / count).sqrt(),
        noise_share: total(|sum| sum.1) / count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::{GeneratorSettings, generate};
    use crate::recursive::recipe::Recipe;
    use crate::recursive::sampling::Sampling;
    use crate::recursive::scenario::Scenario;
    use crate::recursive::training::Training;

    #[test]
    fn only_a_posterior_with_variance_has_a_spread() {
        let settings = GeneratorSettings {
            flights: 3,
            ..GeneratorSettings::default()
        };
        let flights = generate(&settings).unwrap();
        for sampling in [Sampling::EveryLayer, Sampling::LastLayer, Sampling::Nothing] {
            let recipe = Recipe {
                sampling,
                flights: 32,
                ..Recipe::DEFAULT
            };
            let model = Training::new(recipe, &flights).unwrap().model();
            let bytes = model.blob().unwrap();
            let cell = &Scenario::Paper.cells(&flights, 1)[3];
            let found = epistemic(&model, Blob::parse(&bytes).unwrap(), cell, 16);
            assert_eq!(
                found.jerk_sigma_mps3 > 0.0,
                sampling != Sampling::Nothing,
                "{found:?}"
            );
            assert!(found.jerk_sigma_mps3 < 5.0);
        }
    }
}
