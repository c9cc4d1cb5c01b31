//! Flights under one noise level and sampling rate, as every filter meets them.

use super::encounter::Encounter;
use super::score::Score;
use crate::flights::flight::{Flight, Sample};
use crate::radar::reading::Reading;
use crate::radar::sampling::time_us;
use crate::scoring::means::Sums;
use crate::scoring::position::position;
use crate::scoring::step_score::StepScore;
use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::recursive::population::Population;
use bnkf::{
    Correction, Estimate, Inference, Measurement, Mode, Settings, StepError, Tracker, TrackerError,
};
use rayon::prelude::*;
use serde::Serialize;

/// One flight and what the radar reads of it.
#[derive(Clone, Debug)]
pub struct Trial {
    /// True samples.
    pub samples: Vec<Sample>,
    /// Microseconds since the first sample, one for each.
    pub times_us: Vec<u64>,
    /// Readings, one for each sample, `None` in a gap.
    pub readings: Vec<Option<Reading>>,
}

/// Trials under one noise and rate.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Noise and rate.
    pub name: String,
    /// One for each flight.
    pub trials: Vec<Trial>,
}

/// How the firmware's tracker did, and what it had to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrackerScore {
    /// Distance, NEES and coverage of every step after the first; a refused step counts as lost and is scored with
    /// the estimate before it, as unusable where there is none.
    pub score: Score,
    /// Measurements outside the gate.
    pub rejected: usize,
    /// Times that another track took over or the filter was started anew.
    pub restarted: usize,
}

/// What [`TrackerScore`] sums up.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    sums: Sums,
    lost: usize,
    rejected: usize,
    restarted: usize,
}

impl Cell {
    /// What `radar` reads of every flight.
    pub fn new(
        name: String,
        flights: &[Flight],
        radar: impl Fn(&Flight) -> Vec<Option<Reading>> + Sync,
    ) -> Self {
        let trial = |flight: &Flight| {
            let times = flight.samples.iter();
            Trial {
                times_us: times.map(|sample| time_us(flight, sample.time_s)).collect(),
                samples: flight.samples.clone(),
                readings: radar(flight),
            }
        };
        Self {
            name,
            trials: flights.par_iter().map(trial).collect(),
        }
    }

    /// The trials as the training's filter meets them.
    pub fn encounters(&self, population: &Population<f64>) -> Vec<Encounter> {
        let trials = self.trials.iter();
        trials
            .filter_map(|trial| Encounter::new(&trial.samples, &trial.readings, population))
            .collect()
    }

    /// Runs the firmware's tracker over every trial that has a first reading to start from, as [`Self::encounters`].
    ///
    /// # Errors
    /// The blob is of another kind.
    pub fn track(
        &self,
        blob: Blob<'_>,
        inference: Inference,
    ) -> Result<TrackerScore, TrackerError> {
        let settings = |seed| Settings {
            correction: Correction::Polar,
            inference,
            seed,
        };
        let parts: Vec<Part> = self
            .trials
            .par_iter()
            .enumerate()
            .filter(|(_, trial)| trial.readings.first().is_some_and(Option::is_some))
            .map(|(index, trial)| {
                let tracker = Tracker::new(blob, settings(index as u64))?;
                Ok(trial.track(tracker))
            })
            .collect::<Result<_, TrackerError>>()?;
        let total = parts.into_iter().fold(Part::default(), Part::join);
        Ok(TrackerScore {
            score: Score {
                means: total.sums.means(),
                lost: total.lost,
            },
            rejected: total.rejected,
            restarted: total.restarted,
        })
    }
}

impl Trial {
    /// Every sample with the answer of a tracker that meets them in order.
    pub fn answers<'b>(
        &self,
        mut tracker: Tracker<'b>,
    ) -> impl Iterator<Item = (&Sample, Result<Estimate, StepError>)> {
        let times = self.samples.iter().zip(&self.times_us);
        times
            .zip(&self.readings)
            .map(move |((sample, &time_us), reading)| {
                let call = Call::new(time_us, reading.as_ref().map(Measurement::from));
                (sample, call.answer(&mut tracker))
            })
    }

    /// Runs a tracker over the trial.
    fn track(&self, tracker: Tracker<'_>) -> Part {
        let mut part = Part::default();
        let mut latest = None;
        for (index, (sample, answer)) in self.answers(tracker).enumerate() {
            match answer {
                Ok(estimate) => {
                    part.rejected += usize::from(estimate.mode == Mode::Rejected);
                    part.restarted += usize::from(estimate.mode == Mode::Restarted);
                    latest = Some(estimate);
                }
                Err(_) => part.lost += 1,
            }
            if index > 0 {
                let scored = latest.as_ref().map(|estimate| score(estimate, sample));
                part.sums.add(&scored.unwrap_or(StepScore::UNUSABLE));
            }
        }
        part
    }
}

impl Part {
    fn join(self, other: Self) -> Self {
        Self {
            sums: self.sums.join(other.sums),
            lost: self.lost + other.lost,
            rejected: self.rejected + other.rejected,
            restarted: self.restarted + other.restarted,
        }
    }
}

/// The score of an estimate beside the sample of its time.
pub(super) fn score(estimate: &Estimate, sample: &Sample) -> StepScore {
    let (position_m, covariance_m2) = position(estimate);
    StepScore::new(&position_m, &covariance_m2, &sample.position_m.into())
        .unwrap_or(StepScore::UNUSABLE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::generator::{GeneratorSettings, generate};
    use crate::kernel::Tier;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::recipe::Recipe;
    use crate::recursive::scenario::Scenario;
    use crate::recursive::step::Weighing;
    use crate::recursive::step_programs::Programs;
    use crate::recursive::training::Training;

    #[test]
    fn the_firmware_scores_what_the_training_does() {
        let settings = GeneratorSettings {
            flights: 12,
            ..GeneratorSettings::default()
        };
        let flights = generate(&settings).unwrap();
        let recipe = Recipe {
            flights: 32,
            ..Recipe::DEFAULT
        };
        let training = Training::new(recipe, &flights).unwrap();
        let model = training.model();
        let bytes = model.blob().unwrap();
        let weights = training.network.weights(Tier::detect(), Sampling::Nothing);
        let programs = Programs::new(&model.parameters, &model.normalisation, Weighing::All);
        for cell in Scenario::Paper.cells(&flights, 5) {
            let encounters = cell.encounters(&training.parameters.population);
            let expected = Score::of(&programs, &weights, &encounters);
            let tracked = cell
                .track(Blob::parse(&bytes).unwrap(), Inference::Mean)
                .unwrap();
            assert_eq!((tracked.score.lost, tracked.restarted), (0, 0));
            let (score, expected) = (tracked.score.means, expected.means);
            assert_eq!(score.steps, expected.steps);
            assert!((score.distance_m / expected.distance_m - 1.0).abs() < 0.01);
            assert!((score.nees - expected.nees).abs() < 0.1);
            assert!((score.surprise - expected.surprise).abs() < 0.02);
            assert!(expected.surprise != 0.0);
        }
    }

    /// The first measurement of the first flight is further than any radar sees; the second flight has none.
    #[test]
    fn a_refused_start_is_a_lost_step() {
        let settings = GeneratorSettings {
            flights: 3,
            ..GeneratorSettings::default()
        };
        let flights = generate(&settings).unwrap();
        let mut cell = Scenario::Paper.cells(&flights, 5).remove(0);
        let blob = Blob::parse(include_bytes!("../../../models/recursive.bnkf")).unwrap();
        let whole = cell.track(blob, Inference::Mean).unwrap().score;
        let steps: usize = flights.iter().map(|flight| flight.samples.len() - 1).sum();
        assert_eq!((whole.lost, whole.means.steps), (0, steps as u64));
        if let Some(reading) = &mut cell.trials[0].readings[0] {
            reading.range_m = 1e9;
        }
        cell.trials[1].readings[0] = None;
        let steps = steps - (flights[1].samples.len() - 1);
        let found = cell.track(blob, Inference::Mean).unwrap().score;
        assert_eq!((found.lost, found.means.steps), (1, steps as u64));
        assert!(found.means.distance_m.is_finite());
        // Its second is refused as well: nothing stands for it.
        if let Some(reading) = &mut cell.trials[0].readings[1] {
            reading.range_m = 1e9;
        }
        let found = cell.track(blob, Inference::Mean).unwrap().score;
        assert_eq!((found.lost, found.means.steps), (2, steps as u64));
        assert!(found.means.distance_m.is_nan());
    }
}
