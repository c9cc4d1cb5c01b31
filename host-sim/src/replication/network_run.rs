//! One training at one noise level, and every use that is made of its networks.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::scoring::step_score::StepScore;
use bnkf_model_export::seed;
use nalgebra::{Matrix3, Vector3};

use super::correction::{corrected, uncorrected};
use super::departure::Departure;
use super::entry::Estimator;
use super::learner::{Divergence, INITIAL_SIGMA, LearnerSettings, train};
use super::moments::{Ensemble, StateMoments};
use super::observation::observe;
use super::pair::{Pair, pairs};
use super::recipe::Recipe;
use super::scaling::Scaling;
use super::study::{Study, StudyError};
use super::summary::Tally;

/// Which networks are trained, on what.
pub(super) struct NetworkRun<'a> {
    pub study: &'a Study,
    /// The training part of a recipe.
    pub recipe: Recipe,
    /// One network for each output instead of one for all.
    pub per_output: bool,
    /// Noise level: every level has networks of its own.
    pub level: NoiseLevel,
}

/// An answer for one sample of a flight; `None` if the correction has none.
type Answer = Option<(Vector3<f64>, Matrix3<f64>)>;

impl NetworkRun<'_> {
    /// Units of work that are reported: epochs of a whole network; small ones count a quarter.
    pub fn units(recipe: &Recipe, per_output: bool, epochs: u32) -> u64 {
        let epochs = u64::from(epochs) * 4;
        if per_output {
            epochs / 4 * recipe.outputs() as u64
        } else {
            epochs
        }
    }

    /// Trains the networks, then scores `users` on the tested flights.
    pub fn tallies(
        &self,
        users: &[(Estimator, Recipe)],
        advance: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Tally>, StudyError> {
        let split = self.study.split(&self.recipe)?;
        let (features, targets) = self.examples(&split.training);
        if features.is_empty() {
            return Err(StudyError::NoPairs);
        }
        let scaling = Scaling::of(&features, &targets);
        let rows = scaling.rows(&features, &targets, self.per_output);
        let networks = if self.per_output {
            self.recipe.outputs()
        } else {
            1
        };
        let mut members = Vec::new();
        for index in 0..networks {
            let settings = LearnerSettings {
                architecture: self.recipe.architecture(self.per_output)?,
                first_target: index,
                divergence: self.divergence(rows.len()),
                epochs: self.study.epochs,
                seed: self.seed(
                    "network",
                    2 * index as u64 + u64::from(self.recipe.other_luck),
                ),
            };
            let unit = if self.per_output { 1 } else { 4 };
            members.push(train(&settings, &rows, &mut || advance(unit))?);
        }
        let mut ensemble = Ensemble::new(
            &members,
            scaling.clone(),
            self.recipe.outputs(),
            self.study.passes,
        );
        let mut tallies = vec![Tally::default(); users.len()];
        for (index, flight) in split.tested.iter().enumerate() {
            for (rate_index, rate) in SamplingRate::ALL.into_iter().enumerate() {
                let found = self.pairs(flight, rate);
                if found.is_empty() {
                    continue;
                }
                let (features, targets) = split_examples(flight, &self.recipe, &found);
                let rows = scaling.rows(&features, &targets, self.per_output);
                let place = (index * SamplingRate::ALL.len() + rate_index) as u64;
                let moments = ensemble.moments(&rows, self.seed("passes", place));
                for ((estimator, recipe), tally) in users.iter().zip(&mut tallies) {
                    tally.append(scored(flight, &found, &moments, *estimator, recipe));
                }
            }
        }
        Ok(tallies)
    }

    fn divergence(&self, rows: usize) -> Divergence {
        if self.recipe.departs(Departure::LastBias) {
            return Divergence::LastBias;
        }
        Divergence::All {
            factor: if self.recipe.divergence_per_row {
                1.0 / rows as f64
            } else {
                1.0
            },
            prior_sigma: if self.recipe.unit_prior {
                1.0
            } else {
                INITIAL_SIGMA
            },
        }
    }

    fn seed(&self, name: &str, index: u64) -> u64 {
        let ids = [seed::name_id(name), index];
        seed::derive(self.study.level_seed(self.level), &ids)
    }

    fn pairs(&self, flight: &Flight, rate: SamplingRate) -> Vec<Pair> {
        let seed = self.study.level_seed(self.level);
        pairs(
            &observe(flight, &self.recipe, self.level, rate, seed),
            &self.recipe,
        )
    }

    /// Features and targets of every pair of `flights` at every sampling rate.
    fn examples(&self, flights: &[&Flight]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let (mut features, mut targets) = (Vec::new(), Vec::new());
        for flight in flights {
            for rate in SamplingRate::ALL {
                let found = self.pairs(flight, rate);
                let (more_features, more_targets) = split_examples(flight, &self.recipe, &found);
                features.extend(more_features);
                targets.extend(more_targets);
            }
        }
        (features, targets)
    }
}

/// Features of `pairs` and the true states they belong to.
fn split_examples(
    flight: &Flight,
    recipe: &Recipe,
    pairs: &[Pair],
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let target = |pair: &Pair| {
        let sample = &flight.samples[pair.sample];
        let mut state = sample.position_m.to_vec();
        state.extend(sample.velocity_mps);
        state.truncate(recipe.outputs());
        state
    };
    let features = pairs.iter().map(|pair| pair.features.clone()).collect();
    (features, pairs.iter().map(target).collect())
}

/// Scores one use of the networks over a flight. Where gaps are scored the last answer is held in
/// them, and until the end; before the first answer there is nothing to score.
fn scored(
    flight: &Flight,
    pairs: &[Pair],
    moments: &[StateMoments],
    estimator: Estimator,
    recipe: &Recipe,
) -> Tally {
    let answer = |pair: &Pair, moments: &StateMoments| -> Answer {
        if estimator == Estimator::Bnn {
            Some(uncorrected(moments))
        } else {
            corrected(moments, &pair.later, recipe)
        }
    };
    let mut tally = Tally::default();
    let ends = pairs.iter().skip(1).map(|pair| pair.sample);
    let ends = ends.chain(std::iter::once(flight.samples.len()));
    for ((pair, moments), end) in pairs.iter().zip(moments).zip(ends) {
        let answer = answer(pair, moments);
        let held = if recipe.departs(Departure::GapsUnscored) {
            pair.sample + 1
        } else {
            end
        };
        for sample in &flight.samples[pair.sample..held] {
            let truth_m = sample.position_m.into();
            let score = answer.and_then(|(position, covariance)| {
                StepScore::new(&position, &covariance, &truth_m).ok()
            });
            tally.add(score, recipe);
        }
    }
    tally
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;
    use nalgebra::{Matrix6, Vector6};

    use super::{Departure, Estimator, Recipe, StateMoments, pairs, scored};

    /// Ten samples along x, 1 m apart; samples 0, 1, 2, 6 and 7 are measured.
    fn flight_and_readings() -> (Flight, Vec<Option<Reading>>) {
        let rows: Vec<[f64; 4]> = (0..10)
            .map(|i| [f64::from(i) * 0.1, 20.0 + f64::from(i), 0.0, 0.0])
            .collect();
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let mut readings = vec![None; 10];
        for sample in [0, 1, 2, 6, 7] {
            readings[sample] = Some(Reading {
                time_us: 100_000 * sample as u64,
                range_m: 20.0 + sample as f64,
                elevation_rad: 0.0,
                azimuth_rad: 0.0,
                range_rate_mps: 10.0,
                sigma_range_m: 1.0,
                sigma_elevation_rad: 0.1,
                sigma_azimuth_rad: 0.1,
                sigma_range_rate_mps: 1.0,
                sensor: Pose::ORIGIN,
                late_us: 0,
            });
        }
        (flight, readings)
    }

    #[test]
    fn gaps_are_scored_with_the_last_answer_or_not_at_all() {
        let (flight, readings) = flight_and_readings();
        let found = pairs(&readings, &Recipe::PAPER);
        // Every answer is the truth of its sample, so an error is the age of the answer.
        let moments: Vec<StateMoments> = found
            .iter()
            .map(|pair| StateMoments {
                mean: Vector6::new(20.0 + pair.sample as f64, 0.0, 0.0, 0.0, 0.0, 0.0),
                covariance: Matrix6::identity(),
            })
            .collect();
        let tally = |recipe| scored(&flight, &found, &moments, Estimator::Bnn, &recipe).summary();
        let whole = tally(Recipe::PAPER);
        // Samples 1 to 9; held are 3, 4, 5 (after 2) and 8, 9 (after 7).
        assert_eq!(whole.scored, 9);
        let ages = 1.0 + 2.0 + 3.0 + 1.0 + 2.0;
        assert!((whole.error_m - ages / 9.0).abs() < 1e-12);
        let measured = tally(Recipe::PAPER.with(Departure::GapsUnscored));
        assert_eq!((measured.scored, measured.error_m), (4, 0.0));
    }
}
