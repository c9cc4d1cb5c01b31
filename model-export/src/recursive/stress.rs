//! Flights and faults that a tracker must survive: no NaN, no covariance that is not positive
//! definite, every restart explained.

use super::trial::{Trial, score};
use crate::flights::flight::{Flight, Sample};
use crate::radar::errors::spoil;
use crate::radar::gaps::SamplingRate;
use crate::radar::noise::{NoiseLevel, NoiseTable};
use crate::radar::sampling::{RadarSettings, sample_radars, time_us};
use crate::radar::sensors::Sensors;
use crate::random_source::RandomSource;
use crate::seed::name_id;
use crate::soundness::{is_definite, is_finite};
use bnkf::blob::Blob;
use bnkf::{Correction, Inference, Mode, Settings, StepError, Tracker};
use rayon::prelude::*;
use serde::Serialize;

/// Samples of a flight, ten a second.
const SAMPLES: usize = 200;

/// What is wrong with a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hardship {
    /// Passes within half a metre of the vertical above the radar.
    Zenith,
    /// 15 to 30 m/s, weaving with up to 8 m/s^2.
    Fast,
    /// Five seconds without a measurement, three times.
    Gaps,
    /// One measurement in ten is wrong by 5 to 50 sigmas.
    Outliers,
    /// The sensor is twice as good or half as good as it says.
    Misstated,
    /// The radar drives on a circle of 3 to 60 m at up to 40 m/s.
    Driving,
}

impl Hardship {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Zenith,
        Self::Fast,
        Self::Gaps,
        Self::Outliers,
        Self::Misstated,
        Self::Driving,
    ];

    /// The name that tables print.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Zenith => "zenith",
            Self::Fast => "fast",
            Self::Gaps => "gaps",
            Self::Outliers => "outliers",
            Self::Misstated => "misstated",
            Self::Driving => "driving",
        }
    }
}

/// What happened, summed over flights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tally {
    /// Flights.
    pub flights: usize,
    /// Estimates that were checked.
    pub estimates: usize,
    /// Estimates with a number that is NaN or infinite.
    pub not_finite: usize,
    /// Covariances (three by three, nine by nine) that are not symmetric positive definite.
    pub not_definite: usize,
    /// Steps that the tracker refused although the measurement could be used.
    pub refused: usize,
    /// Measurements that cannot be used and were refused, such as a range beyond any that is measured.
    pub unusable: usize,
    /// Measurements outside the gate.
    pub rejected: usize,
    /// Restarts after three measurements in a row outside the gate.
    pub restarts_gate: usize,
    /// Restarts of a state that left its bounds or whose correction failed.
    pub restarts_bounds: usize,
    /// Sum of the distances to the true position, metres.
    pub distance_m: f64,
}

impl Tally {
    fn join(self, other: Self) -> Self {
        Self {
            flights: self.flights + other.flights,
            estimates: self.estimates + other.estimates,
            not_finite: self.not_finite + other.not_finite,
            not_definite: self.not_definite + other.not_definite,
            refused: self.refused + other.refused,
            unusable: self.unusable + other.unusable,
            rejected: self.rejected + other.rejected,
            restarts_gate: self.restarts_gate + other.restarts_gate,
            restarts_bounds: self.restarts_bounds + other.restarts_bounds,
            distance_m: self.distance_m + other.distance_m,
        }
    }

    /// Whether nothing happened that must not.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.not_finite == 0 && self.not_definite == 0 && self.refused == 0
    }

    /// Mean distance to the true position, metres.
    #[must_use]
    pub fn mean_distance_m(&self) -> f64 {
        self.distance_m / self.estimates as f64
    }
}

/// Runs `flights` flights of each hardship under any of the paper's noise levels and rates.
pub fn campaign(
    blob: Blob<'_>,
    inference: Inference,
    flights: usize,
    seed: u64,
) -> Vec<(Hardship, Tally)> {
    let run = |hardship| {
        let tallies: Vec<Tally> = (0..flights)
            .into_par_iter()
            .map(|index| {
                let settings = Settings {
                    correction: Correction::Polar,
                    inference,
                    seed: index as u64,
                };
                let trial = trial(hardship, index, seed);
                // Settings that do not fit refuse every step.
                Tracker::new(blob, settings).map_or_else(
                    |_| Tally {
                        flights: 1,
                        refused: SAMPLES,
                        ..Tally::default()
                    },
                    |tracker| tally(&trial, tracker),
                )
            })
            .collect();
        let total = tallies.into_iter().fold(Tally::default(), Tally::join);
        (hardship, total)
    };
    Hardship::ALL.into_iter().map(run).collect()
}

fn tally(trial: &Trial, tracker: Tracker<'_>) -> Tally {
    let mut tally = Tally {
        flights: 1,
        ..Tally::default()
    };
    let mut in_a_row = 0;
    for (sample, answer) in trial.answers(tracker) {
        let estimate = match answer {
            Ok(estimate) => estimate,
            Err(StepError::Measurement(_)) => {
                tally.unusable += 1;
                continue;
            }
            Err(_) => {
                tally.refused += 1;
                continue;
            }
        };
        match estimate.mode {
            Mode::Rejected => {
                tally.rejected += 1;
                in_a_row += 1;
            }
            Mode::Restarted if in_a_row >= 2 => tally.restarts_gate += 1,
            Mode::Restarted => tally.restarts_bounds += 1,
            Mode::Started | Mode::Tracking | Mode::Coasting => {}
        }
        if matches!(estimate.mode, Mode::Tracking | Mode::Restarted) {
            in_a_row = 0;
        }
        tally.estimates += 1;
        tally.not_finite += usize::from(!is_finite(&estimate));
        tally.not_definite += usize::from(!is_definite(&estimate));
        tally.distance_m += score(&estimate, sample).error_m;
    }
    tally
}

fn trial(hardship: Hardship, index: usize, seed: u64) -> Trial {
    let ids = [name_id("stress"), hardship as u64, index as u64];
    let mut random = RandomSource::new(seed, &ids);
    let flight = Flight {
        name: format!("{} {index}", hardship.name()),
        source: "stress".to_owned(),
        samples: course(hardship, &mut random),
    };
    let table = [NoiseTable::Radians, NoiseTable::Printed][random.below(2)];
    let level = NoiseLevel::ALL[random.below(3)];
    let rate = SamplingRate::ALL[random.below(3)];
    let mut settings = RadarSettings::paper(level, table, rate, seed);
    if hardship == Hardship::Misstated {
        settings.stated = settings.noise.scaled([0.5, 2.0][random.below(2)]);
    }
    let sensors = if hardship == Hardship::Driving {
        Sensors::Circling {
            radius_m: random.uniform(3.0, 60.0),
            speed_mps: random.uniform(-40.0, 40.0),
        }
    } else {
        Sensors::Origin
    };
    let mut readings = sample_radars(&flight, &settings, |turn, time_s| {
        sensors.pose(turn, time_s)
    });
    match hardship {
        Hardship::Gaps => {
            for from in [20, 85, 145] {
                readings[from..from + 50].fill(None);
            }
        }
        Hardship::Outliers => {
            for reading in readings.iter_mut().skip(1).flatten() {
                if random.chance(0.1) {
                    spoil(reading, &mut random);
                }
            }
        }
        Hardship::Zenith | Hardship::Fast | Hardship::Misstated | Hardship::Driving => {}
    }
    let times = flight.samples.iter();
    Trial {
        times_us: times
            .map(|sample| time_us(&flight, sample.time_s))
            .collect(),
        readings,
        samples: flight.samples,
    }
}

/// A straight line with two sine waves across it.
fn course(hardship: Hardship, random: &mut RandomSource) -> Vec<Sample> {
    let duration_s = 0.1 * SAMPLES as f64;
    let (speed, sway, miss_m) = match hardship {
        Hardship::Zenith => (
            random.uniform(1.0, 15.0),
            random.uniform(0.0, 0.2),
            random.uniform(-0.5, 0.5),
        ),
        Hardship::Fast => (
            random.uniform(15.0, 30.0),
            random.uniform(0.0, 8.0),
            random.uniform(5.0, 100.0),
        ),
        _ => (
            random.uniform(0.0, 6.0),
            random.uniform(0.0, 3.0),
            random.uniform(10.0, 35.0),
        ),
    };
    let (s, c) = random.uniform(0.0, core::f64::consts::TAU).sin_cos();
    let height_m = random.uniform(5.0, 30.0);
    let pulse = random.uniform(0.5, 2.0);
    let phase = random.uniform(0.0, core::f64::consts::TAU);
    (0..SAMPLES)
        .map(|i| {
            let time_s = 0.1 * i as f64;
            let angle = pulse * time_s + phase;
            let along = [speed * (time_s - 0.5 * duration_s), speed];
            let (amplitude, rate) = (sway / (pulse * pulse), sway / pulse);
            let across = [miss_m + amplitude * angle.sin(), rate * angle.cos()];
            let up = [
                height_m + 0.3 * amplitude * (0.7 * angle).sin(),
                0.21 * rate * (0.7 * angle).cos(),
            ];
            let world = |k: usize| {
                [
                    c * along[k] - s * across[k],
                    s * along[k] + c * across[k],
                    up[k],
                ]
            };
            Sample {
                time_s,
                position_m: world(0),
                velocity_mps: world(1),
            }
        })
        .collect()
}

/// A line for each hardship.
#[must_use]
pub fn table(found: &[(Hardship, Tally)]) -> String {
    let mut text = format!(
        "{:<10}{:>8}{:>10}{:>8}{:>8}{:>9}{:>10}{:>10}{:>15}{:>17}{:>10}\n",
        "hardship",
        "flights",
        "estimates",
        "NaN",
        "not PD",
        "refused",
        "unusable",
        "rejected",
        "restarts: gate",
        "restarts: bounds",
        "ED [m]"
    );
    for (hardship, t) in found {
        text += &format!(
            "{:<10}{:>8}{:>10}{:>8}{:>8}{:>9}{:>10}{:>10}{:>15}{:>17}{:>10.3}\n",
            hardship.name(),
            t.flights,
            t.estimates,
            t.not_finite,
            t.not_definite,
            t.refused,
            t.unusable,
            t.rejected,
            t.restarts_gate,
            t.restarts_bounds,
            t.mean_distance_m()
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::model::RecursiveModel;
    use crate::recursive::network::Network;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::normalisation::Normalisation;
    use bnkf::recursive::parameters::Parameters;

    #[test]
    fn courses_hold_what_they_promise() {
        for index in 0..20 {
            let zenith = trial(Hardship::Zenith, index, 1);
            let nearest = zenith
                .samples
                .iter()
                .map(|s| s.position_m[0].hypot(s.position_m[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest < 2.5, "{nearest}");
            let fast = trial(Hardship::Fast, index, 1);
            for pair in fast.samples.windows(3) {
                let v = pair[1].velocity_mps;
                assert!(v[0].hypot(v[1]) >= 15.0);
                let slope = (pair[2].position_m[0] - pair[0].position_m[0]) / 0.2;
                assert!((slope - v[0]).abs() < 0.1, "{slope} {v:?}");
            }
            let gaps = trial(Hardship::Gaps, index, 1);
            assert!(gaps.readings[20..70].iter().all(Option::is_none));
        }
    }

    #[test]
    fn the_base_model_survives_every_hardship() {
        let model = RecursiveModel {
            parameters: Parameters::PAPER,
            normalisation: Normalisation::IDENTITY,
            network: Network::new(3),
            sampling: Sampling::EveryLayer,
        };
        let bytes = model.blob().unwrap();
        let blob = Blob::parse(&bytes).unwrap();
        for passes in [1, 3] {
            let inference = Inference::of_passes(passes).unwrap();
            for (hardship, tally) in campaign(blob, inference, 20, 1) {
                assert!(tally.passed(), "{} {tally:?}", hardship.name());
                assert_eq!(tally.estimates + tally.unusable, 20 * SAMPLES);
            }
        }
    }

    #[test]
    fn a_tally_with_a_failure_does_not_pass() {
        let clean = Tally::default();
        assert!(clean.passed());
        for failed in [
            Tally {
                not_finite: 1,
                ..clean
            },
            Tally {
                not_definite: 1,
                ..clean
            },
            Tally {
                refused: 1,
                ..clean
            },
        ] {
            assert!(!clean.join(failed).passed());
        }
    }
}
