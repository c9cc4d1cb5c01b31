//! Motion models fitted to training flights by the likelihood of the true position.
//!
//! The score of a filter is the mean over all steps, gaps included, of
//! `-ln N(truth; estimate, covariance)`, over all sampling rates together: one set of parameters
//! serves a noise level at every rate. A score of the position rewards accuracy and an honest
//! covariance at once; the likelihood of the innovations would also pay for the range-rate.
//! Everything is deterministic: seeded noise, no random search, sums in a fixed order.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::time_us;
use bnkf_model_export::scoring::step_score::StepScore;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bank::FiveTurns;
use super::correction::Correction;
use super::imm::Imm;
use super::kalman::Kalman;
use super::origin::Origin;
use super::prior::PopulationPrior;
use super::rao_blackwell::RaoBlackwell;
use super::simplex::{Vertex, minimise};
use super::singer::Singer;
use crate::filter::{Filter, Start};

/// Parameters of the tuned filters at one noise level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Where flights begin.
    pub prior: PopulationPrior,
    /// Motion of the tuned EKF; the UKF, the cubature and the particle filter share it.
    pub singer: Singer,
    /// The bank of five.
    pub five_turns: FiveTurns,
    /// Score of the EKF on the training flights, natural units a step.
    pub singer_score: f64,
    /// Score of the bank of five.
    pub five_turns_score: f64,
}

/// Why nothing could be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TuningError {
    /// There are no flights, no rates, or a flight has no first reading.
    #[error("nothing to tune on: no flight with a first reading")]
    NothingToTuneOn,
}

/// What the radar said of a flight.
struct Recording<'a> {
    flight: &'a Flight,
    readings: Vec<Option<Reading>>,
}

/// Flights, evenly spread, on which the search looks around. With 30 of them, and a second search on
/// all flights from every start, the fits were no better on other flights.
const FLIGHTS_FIRST: usize = 10;
/// Flights, evenly spread, on which the search ends. Which flights they are still decides 2 % of the
/// distance and .3 of the NEES with 120 of them.
pub const FLIGHTS_MAX: usize = 300;

/// A step's score is not taken to be worse than this: one lost flight must not decide alone.
const SCORE_MAX: f64 = 60.0;

/// Evaluations per parameter, from each start and at the end.
const EVALUATIONS_FIRST: usize = 12;
const EVALUATIONS_LAST: usize = 6;

/// First steps of both searches in the logarithm of every parameter.
const LOG_STEP_FIRST: f64 = 0.7;
const LOG_STEP_LAST: f64 = 0.25;

/// Where the searches start: smooth accelerations, and abrupt ones. The likelihood has a valley
/// at either end, and which is deeper depends on the noise.
const SINGER_STARTS: [[f64; 4]; 2] = [[1.5, 1.0, 0.5, 0.03], [0.5, 0.3, 0.7, 1.0]];
const FIVE_TURNS_STARTS: [[f64; 3]; 2] = [[0.8, 0.1, 0.4], [2.0, 0.4, 1.5]];

impl Tuning {
    /// Fits the motion models to `flights`, of which [`FLIGHTS_MAX`] at most, as `measured` at all
    /// `rates`.
    ///
    /// # Errors
    /// See [`TuningError`].
    pub fn fit(
        prior: PopulationPrior,
        flights: &[&Flight],
        rates: &[SamplingRate],
        measured: impl Fn(&Flight, SamplingRate) -> Vec<Option<Reading>>,
    ) -> Result<Self, TuningError> {
        let few = record(flights, FLIGHTS_FIRST, rates, &measured);
        let many = record(flights, FLIGHTS_MAX, rates, &measured);
        let usable = |r: &Recording<'_>| r.readings.first().is_some_and(Option::is_some);
        if many.is_empty() || !few.iter().chain(&many).all(usable) {
            return Err(TuningError::NothingToTuneOn);
        }
        let origin = Origin::Population(prior);
        let ekf = |x: &[f64; 4]| Kalman::new(singer(x), Correction::Extended, origin);
        let ekf_score = |x: &[f64; 4], on: &[Recording<'_>]| mean_score(|| ekf(x), on);
        let singer_fit = search(ekf_score, &SINGER_STARTS, &few, &many);
        let imm = |x: &[f64; 3]| Imm::five(&five_turns(x), origin);
        let imm_score = |x: &[f64; 3], on: &[Recording<'_>]| mean_score(|| imm(x), on);
        let turns_fit = search(imm_score, &FIVE_TURNS_STARTS, &few, &many);
        Ok(Self {
            prior,
            singer: singer(&singer_fit.at),
            five_turns: five_turns(&turns_fit.at),
            singer_score: singer_fit.value,
            five_turns_score: turns_fit.value,
        })
    }

    /// The start of every tuned filter.
    pub fn origin(&self) -> Origin {
        Origin::Population(self.prior)
    }

    /// The tuned Kalman filter with this correction: EKF, UKF or CKF.
    pub fn kalman(&self, correction: Correction) -> Kalman<Singer, 9> {
        Kalman::new(self.singer, correction, self.origin())
    }

    /// The particle filter with the tuned motion.
    pub fn rao_blackwell(&self, seed: u64) -> RaoBlackwell {
        RaoBlackwell::new(self.singer, self.prior, seed)
    }

    /// The tuned bank of five.
    pub fn imm_five(&self) -> Imm<5> {
        Imm::five(&self.five_turns, self.origin())
    }
}

/// The best parameters, as logarithms: from every start on few flights, then from the best point
/// found on many.
fn search<const D: usize>(
    score: impl Fn(&[f64; D], &[Recording<'_>]) -> f64,
    starts: &[[f64; D]],
    few: &[Recording<'_>],
    many: &[Recording<'_>],
) -> Vertex<D> {
    let mut best = Vertex {
        at: [0.0; D],
        value: f64::INFINITY,
    };
    for start in starts {
        let budget = EVALUATIONS_FIRST * D;
        let found = minimise(
            |x| score(x, few),
            start.map(f64::ln),
            LOG_STEP_FIRST,
            budget,
        );
        if found.value < best.value {
            best = found;
        }
    }
    minimise(
        |x| score(x, many),
        best.at,
        LOG_STEP_LAST,
        EVALUATIONS_LAST * D,
    )
}

/// Parameters of the model from their logarithms, within bounds no drone exceeds.
fn singer(log: &[f64; 4]) -> Singer {
    Singer {
        acceleration_sigma_mps2: log[0].exp().clamp(1e-3, 100.0),
        correlation_time_s: log[1].exp().clamp(0.03, 30.0),
        damping_per_s: log[2].exp().clamp(1e-4, 10.0),
        q_m2_s3: log[3].exp().clamp(1e-5, 1e3),
    }
}

fn five_turns(log: &[f64; 3]) -> FiveTurns {
    FiveTurns {
        turn_rate_radps: log[0].exp().clamp(1e-3, 6.0),
        damping_per_s: log[1].exp().clamp(1e-4, 10.0),
        q_m2_s3: log[2].exp().clamp(1e-5, 1e3),
    }
}

/// At most `flights_max` of `flights`, evenly spread.
pub fn spread<'a>(flights: &[&'a Flight], flights_max: usize) -> impl Iterator<Item = &'a Flight> {
    let (all, count) = (flights.len(), flights.len().min(flights_max));
    (0..count).map(move |index| flights[index * all / count])
}

fn record<'a>(
    flights: &[&'a Flight],
    flights_max: usize,
    rates: &[SamplingRate],
    measured: impl Fn(&Flight, SamplingRate) -> Vec<Option<Reading>>,
) -> Vec<Recording<'a>> {
    let chosen = spread(flights, flights_max);
    let cases = chosen.flat_map(|flight| rates.iter().map(move |rate| (flight, *rate)));
    cases
        .map(|(flight, rate)| Recording {
            flight,
            readings: measured(flight, rate),
        })
        .collect()
}

/// Mean over recordings of the mean score of their steps.
fn mean_score<F: Filter>(make: impl Fn() -> F + Sync, recordings: &[Recording<'_>]) -> f64 {
    let scores: Vec<f64> = recordings
        .par_iter()
        .map(|recording| score(&mut make(), recording))
        .collect();
    scores.iter().sum::<f64>() / scores.len() as f64
}

fn score(filter: &mut impl Filter, recording: &Recording<'_>) -> f64 {
    let samples = &recording.flight.samples;
    let (Some(first), Some(Some(reading))) = (samples.first(), recording.readings.first()) else {
        return SCORE_MAX;
    };
    let start = Start {
        reading,
        true_position_m: first.position_m.into(),
        true_velocity_mps: first.velocity_mps.into(),
    };
    if filter.start(&start).is_err() {
        return SCORE_MAX;
    }
    let mut sum = 0.0;
    let mut steps = 0;
    for (sample, reading) in samples.iter().zip(&recording.readings).skip(1) {
        let estimate = filter.step(time_us(recording.flight, sample.time_s), reading.as_ref());
        sum += estimate.map_or(SCORE_MAX, |estimate| {
            let truth = sample.position_m.into();
            StepScore::new(&estimate.position_m, &estimate.covariance_m2, &truth)
                .map_or(SCORE_MAX, |score| {
                    score.negative_log_likelihood().min(SCORE_MAX)
                })
        });
        steps += 1;
    }
    sum / f64::from(steps.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::discrete::Discrete;
    use bnkf_model_export::flights::flight::Sample;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};
    use bnkf_model_export::random_source::RandomSource;

    const TRUE_MOTION: Singer = Singer {
        acceleration_sigma_mps2: 1.5,
        correlation_time_s: 1.0,
        damping_per_s: 0.5,
        q_m2_s3: 0.1,
    };

    /// A flight that the model itself makes, 4 s at 10 Hz, about 30 m from the radar.
    fn flight(number: u64) -> Flight {
        let mut random = RandomSource::new(3, &[number]);
        let step = Discrete::new(&TRUE_MOTION, 0.1);
        let root = step.noise.cholesky().unwrap().unpack();
        let mut state = nalgebra::SVector::<f64, 9>::zeros();
        state
            .fixed_rows_mut::<3>(0)
            .copy_from_slice(&[24.0, -random.uniform(14.0, 18.0), 13.0]);
        let samples = (0..40).map(|k| {
            let sample = Sample {
                time_s: 0.1 * f64::from(k),
                position_m: [state[0], state[1], state[2]],
                velocity_mps: [state[3], state[4], state[5]],
            };
            state = step.transition * state + root * state.map(|_| random.normal());
            sample
        });
        let name = format!("model {number}");
        Flight {
            source: name.clone(),
            name,
            samples: samples.collect(),
        }
    }

    /// The flight at medium noise.
    fn medium(flight: &Flight, rate: SamplingRate) -> Vec<Option<Reading>> {
        let radar = RadarSettings::paper(NoiseLevel::Medium, NoiseTable::Radians, rate, 9);
        sample_radar(flight, &radar)
    }

    #[test]
    fn the_fit_is_repeatable_and_no_worse_than_the_true_model() {
        let flights: Vec<Flight> = (0..4).map(flight).collect();
        let flights: Vec<&Flight> = flights.iter().collect();
        let prior = PopulationPrior::fit(flights.iter().copied()).unwrap();
        let rates = [SamplingRate::THREE_QUARTERS];
        let fit = || Tuning::fit(prior, &flights, &rates, medium).unwrap();
        let tuning = fit();
        assert_eq!(tuning, fit());

        let recordings = record(&flights, FLIGHTS_MAX, &rates, medium);
        let origin = Origin::Population(prior);
        let score = |motion| {
            mean_score(
                || Kalman::new(motion, Correction::Extended, origin),
                &recordings,
            )
        };
        assert_eq!(score(tuning.singer), tuning.singer_score);
        assert!(tuning.singer_score < score(TRUE_MOTION) + 0.01);
        // A model that ignores what moves the drone is told apart clearly.
        let calm = Singer {
            acceleration_sigma_mps2: 0.1,
            q_m2_s3: 0.01,
            ..TRUE_MOTION
        };
        assert!(tuning.singer_score < score(calm) - 0.3);
    }

    #[test]
    fn nothing_to_tune_on_is_an_error() {
        let f = flight(0);
        let prior = PopulationPrior::fit([&f]).unwrap();
        for (flights, rates) in [(vec![], vec![SamplingRate::FULL]), (vec![&f], vec![])] {
            let result = Tuning::fit(prior, &flights, &rates, medium);
            assert_eq!(result, Err(TuningError::NothingToTuneOn));
        }
    }
}
