//! How much of what acceleration adds to a forecast comes true in own flights.
//!
//! Targets that brake or turn back within a second or two do not go on as built-in flights do, and a track
//! that is a few seconds old has hardly seen it. So the firmware's tracker follows own flights with one
//! coefficient after the other as its prior ([`bnkf::recursive::foresight`]), and the one under which
//! the truth ahead is likeliest is taken, held to the shipped one by a normal prior of its own.

use super::model::RecursiveModel;
use crate::flights::flight::Flight;
use crate::radar::reading::Reading;
use crate::radar::sampling::time_us;
use crate::scoring::horizons::{Ahead, HORIZONS_US};
use crate::scoring::position::position;
use crate::scoring::step_score::{SURPRISE_MAX_NATS, StepScore};
use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::{Correction, Estimate, Inference, Measurement, Settings, StepError, Tracker};
use rayon::prelude::*;

/// Coefficients that are tried are as far apart as this.
const STEP: f64 = 0.1;
/// Number of them, from none at all.
const CANDIDATES: u16 = 13;
/// Standard deviation of the prior about the shipped coefficient.
const WIDTH: f64 = 0.3;
/// Time after which a flight says something new of two seconds ahead, s.
const APART_S: f64 = 2.0;

/// A flight and what is read of it.
type Meeting = (Flight, Vec<Option<Reading>>);

/// Surprise of forecasts by horizon, nats, and their numbers.
type Surprises = [(f64, usize); HORIZONS_US.len()];

/// The coefficient that own flights of `duration_s` in all, which are met in `meetings`, speak for; the model's where
/// they say nothing or the model cannot fly.
pub fn learned(model: &RecursiveModel, meetings: &[Meeting], duration_s: f64) -> f64 {
    let shipped = model.parameters.bend;
    let nats = |bend: f64| {
        let surprise = mean_surprise(&with(model, bend), meetings)?;
        Some(posterior(bend, shipped, surprise, duration_s))
    };
    let tried = (0..CANDIDATES).map(|number| STEP * f64::from(number));
    let scored = tried.filter_map(|bend| Some((nats(bend)?, bend)));
    let best = scored.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(shipped, |(_, bend)| bend)
}

/// Negative logarithm of the posterior of a coefficient under which forecasts surprise so much on average.
fn posterior(bend: f64, shipped: f64, surprise: f64, duration_s: f64) -> f64 {
    let apart = (bend - shipped) / WIDTH;
    duration_s / APART_S * surprise + 0.5 * apart * apart
}

fn with(model: &RecursiveModel, bend: f64) -> RecursiveModel {
    let mut other = model.clone();
    other.parameters.bend = bend;
    other
}

/// Mean over horizons of the mean surprise, nats; `None` without forecasts or without a blob.
fn mean_surprise(model: &RecursiveModel, meetings: &[Meeting]) -> Option<f64> {
    let bytes = model.blob().ok()?;
    let blob = Blob::parse(&bytes).ok()?;
    let parts: Vec<Surprises> = meetings
        .par_iter()
        .enumerate()
        .filter_map(|(index, meeting)| {
            let settings = Settings {
                correction: Correction::Polar,
                inference: Inference::Mean,
                seed: index as u64,
            };
            Some(surprises(Tracker::new(blob, settings).ok()?, meeting))
        })
        .collect();
    let mut mean = 0.0;
    for horizon in 0..HORIZONS_US.len() {
        let own = parts.iter().map(|part| part[horizon]);
        let (sum, count) = own.fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        if count == 0 {
            return None;
        }
        mean += sum / (count * HORIZONS_US.len()) as f64;
    }
    Some(mean)
}

/// How much a flight surprises a tracker that meets it.
fn surprises(mut tracker: Tracker<'_>, (flight, readings): &Meeting) -> Surprises {
    let mut surprises = Surprises::default();
    for (number, (sample, reading)) in flight.samples.iter().zip(readings).enumerate() {
        let now_us = time_us(flight, sample.time_s);
        let call = Call::new(now_us, reading.as_ref().map(Measurement::from));
        // A call that is refused leaves the track as it was, and its forecasts are asked for.
        let _ = call.answer(&mut tracker);
        let Some(ahead) = Ahead::of(flight, number) else {
            continue;
        };
        let forecasts = match tracker.forecasts(&ahead.times_us) {
            Err(StepError::NotStarted) => continue,
            forecasts => forecasts.ok(),
        };
        for (horizon, truth_m) in ahead.truths_m.iter().enumerate() {
            let sum = &mut surprises[horizon];
            sum.0 += match &forecasts {
                Some(forecasts) => surprise(&forecasts[horizon], truth_m),
                None => SURPRISE_MAX_NATS,
            };
            sum.1 += 1;
        }
    }
    surprises
}

fn surprise(forecast: &Estimate, truth_m: &[f64; 3]) -> f64 {
    let (position_m, covariance_m2) = position(forecast);
    StepScore::new(&position_m, &covariance_m2, &(*truth_m).into())
        .unwrap_or(StepScore::UNUSABLE)
        .surprise()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::flight::Sample;
    use crate::flights::generator::{GeneratorSettings, generate};
    use crate::random_source::RandomSource;
    use crate::recursive::network::Network;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::normalisation::Normalisation;
    use crate::recursive::recipe::Recipe;
    use crate::recursive::training::Training;
    use crate::recursive::tuning::Tuning;
    use bnkf::recursive::parameters::Parameters;

    fn model() -> RecursiveModel {
        RecursiveModel {
            parameters: Parameters::PAPER,
            normalisation: Normalisation::IDENTITY,
            network: Network::new(5),
            sampling: Sampling::EveryLayer,
        }
    }

    #[test]
    fn a_few_seconds_hardly_move_it_and_minutes_do() {
        // A tenth of a nat for a coefficient of .4.
        let gain = |duration_s| {
            posterior(0.4, 1.0, 4.9, duration_s) - posterior(1.0, 1.0, 5.0, duration_s)
        };
        assert!((gain(10.0) - (2.0 - 0.5)).abs() < 1e-12);
        assert!((gain(100.0) - (2.0 - 5.0)).abs() < 1e-12);
    }

    #[test]
    fn without_flights_it_stays() {
        let mut model = model();
        model.parameters.bend = 0.7;
        assert_eq!(learned(&model, &[], 100.0), 0.7);
    }

    /// Four flights of 15 s on circles flown at 4 m/s^2, once in `turn_s`, and their readings.
    fn circles(turn_s: f64) -> Vec<Meeting> {
        let sensor = Recipe::DEFAULT.sensor.faultless();
        let rate = core::f64::consts::TAU / turn_s;
        let radius_m = 4.0 / (rate * rate);
        let meeting = |lane: u64| {
            let sample = |i: u32| {
                let time_s = 0.1 * f64::from(i);
                let (sin, cos) = (rate * time_s + lane as f64).sin_cos();
                Sample {
                    time_s,
                    position_m: [20.0 + radius_m * cos, 15.0 + radius_m * sin, 12.0],
                    velocity_mps: [-rate * radius_m * sin, rate * radius_m * cos, 0.0],
                }
            };
            let flight = Flight {
                name: lane.to_string(),
                source: String::new(),
                samples: (0..150).map(sample).collect(),
            };
            let mut random = RandomSource::new(3, &[lane]);
            let noise = sensor.draw_noise(&mut random);
            let readings = sensor.readings(noise, &flight, 3, &mut random);
            (flight, readings)
        };
        (0..4).map(meeting).collect()
    }

    /// A network without training hardly moves the base model, whose acceleration lasts a second: too long for
    /// targets that turn round in one, too short for those that take three. Ten minutes find .1 to .2 and the
    /// largest; the bounds only tell less than half from more than all.
    #[test]
    fn targets_that_turn_back_have_less_of_it() {
        let [quick, slow] = [2.0, 6.0].map(|turn_s| learned(&model(), &circles(turn_s), 600.0));
        assert!(quick < 0.5 && slow > 1.0, "{quick} {slow}");
    }

    #[test]
    fn tuning_learns_it_and_training_does_not() {
        let flights = generate(&GeneratorSettings {
            flights: 12,
            ..GeneratorSettings::default()
        })
        .unwrap();
        let recipe = Recipe {
            flights: 32,
            ..Recipe::DEFAULT
        };
        let trained = Training::new(recipe.clone(), &flights).unwrap();
        assert_eq!(trained.model().parameters.bend, 1.0);
        let own: Vec<Flight> = (0..10).flat_map(|_| circles(2.0)).map(|m| m.0).collect();
        let recipe = recipe.tuned(Tuning::new(String::new(), &own, true));
        let tuned = Training::tune(recipe, &flights, &own, &model()).unwrap();
        let bend = tuned.model().parameters.bend;
        // The untouched would be one, to the bit.
        assert!(bend < 0.9, "{bend}");
        // Written, and read again by a tracker.
        let bytes = tuned.model().blob().unwrap();
        let blob = Blob::parse(&bytes).unwrap();
        let read = Parameters::<f64>::read(blob.parameters()).bend;
        assert!((read - bend).abs() < 1e-7, "{read} {bend}");
    }
}
