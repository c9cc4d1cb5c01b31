//! The radars that training flights are measured by: any noise, rate and gap phase, and faults.

use crate::flights::flight::Flight;
use crate::radar::errors::{Errors, spoil};
use crate::radar::gaps::SamplingRate;
use crate::radar::noise::{NoiseLevel, NoiseSigmas, NoiseTable};
use crate::radar::reading::Reading;
use crate::radar::sampling::{RadarSettings, sample_radar};
use crate::random_source::RandomSource;
use bnkf::measurement::Channel;
use serde::{Deserialize, Serialize};

/// Kinds of radar, and how often they are at fault.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Whose noise and rates are drawn from.
    pub family: Family,
    /// Share of flights whose sensor states sigmas that are not its own.
    pub misstated_share: f64,
    /// Share of flights with outliers.
    pub outlier_share: f64,
    /// Share of flights with false alarms: readings of nothing, anywhere in the sky.
    pub false_alarm_share: f64,
    /// Share of flights whose errors are not normal and independent.
    pub errors_share: f64,
    /// Share of flights whose sensor does not measure all four channels, or not all at once.
    pub missing_share: f64,
}

/// Radars that are alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// The paper's three levels by either table, a little off, or any sensor at all; measures in
    /// blocks.
    Paper,
    /// 3 m, 0.2 to 0.9 degrees, 0.2 m/s; every sample to every tenth, with misses.
    CounterUas,
}

impl Sensor {
    /// What the shipped model is trained under.
    pub const PAPER: Self = Self {
        family: Family::Paper,
        misstated_share: 0.04,
        outlier_share: 0.03,
        false_alarm_share: 0.0,
        errors_share: 0.15,
        missing_share: 0.2,
    };
    /// What the training of the shipped model ended under: sensors that are what they say.
    pub const PAPER_END: Self = Self {
        misstated_share: 0.0,
        outlier_share: 0.0,
        errors_share: 0.05,
        ..Self::PAPER
    };
    /// What the counter-UAS model is trained under.
    pub const COUNTER_UAS: Self = Self {
        family: Family::CounterUas,
        misstated_share: 0.04,
        outlier_share: 0.2,
        false_alarm_share: 0.6,
        errors_share: 0.0,
        missing_share: 0.0,
    };

    /// The same sensors without any faults.
    pub fn faultless(self) -> Self {
        Self {
            misstated_share: 0.0,
            outlier_share: 0.0,
            false_alarm_share: 0.0,
            errors_share: 0.0,
            missing_share: 0.0,
            ..self
        }
    }

    /// Readings of `flight` by a sensor of this noise, whose rest is drawn; `seed` gives the readings' noise.
    pub fn readings(
        &self,
        noise: NoiseSigmas,
        flight: &Flight,
        seed: u64,
        random: &mut RandomSource,
    ) -> Vec<Option<Reading>> {
        let rate = match self.family {
            Family::Paper => SamplingRate::ALL[random.below(3)],
            Family::CounterUas => SamplingRate::FULL,
        };
        // Some sensors are better or worse than they say.
        let stated = if random.chance(self.misstated_share) {
            noise.scaled((0.4 * random.normal()).exp())
        } else {
            noise
        };
        // Without a share nothing is drawn: the stream of a shipped model stays what it was.
        let errors = if self.errors_share > 0.0 && random.chance(self.errors_share) {
            draw_errors(random)
        } else {
            Errors::Gaussian
        };
        let settings = RadarSettings {
            noise,
            errors,
            stated,
            rate,
            gap_phase: if random.chance(0.5) {
                random.below(15)
            } else {
                0
            },
            seed,
        };
        let mut readings = sample_radar(flight, &settings);
        if self.family == Family::CounterUas {
            scan(&mut readings, random);
        }
        if random.chance(0.1) {
            // A silence of up to five seconds somewhere after the first one.
            let silence = 10 + random.below(40);
            let from = 10 + random.below(readings.len() - 10);
            for reading in readings.iter_mut().skip(from).take(silence) {
                *reading = None;
            }
        }
        if random.chance(self.outlier_share) {
            let often = random.uniform(0.005, 0.05);
            for reading in readings.iter_mut().skip(1).flatten() {
                if random.chance(often) {
                    spoil(reading, random);
                }
            }
        }
        if self.false_alarm_share > 0.0 && random.chance(self.false_alarm_share) {
            let often = random.uniform(0.002, 0.03);
            let range_m_max = readings.iter().flatten().map(|reading| reading.range_m);
            let range_m_max = 1.5 * range_m_max.fold(1.0, f64::max);
            for reading in readings.iter_mut().skip(1).flatten() {
                if random.chance(often) {
                    imagine(reading, range_m_max, random);
                }
            }
        }
        if self.missing_share > 0.0 && random.chance(self.missing_share) {
            leave_out(&mut readings, random);
        }
        readings
    }

    /// The noise of one sensor.
    pub fn draw_noise(&self, random: &mut RandomSource) -> NoiseSigmas {
        let between = |random: &mut RandomSource, low: f64, high: f64| {
            random.uniform(low.ln(), high.ln()).exp()
        };
        if self.family == Family::CounterUas {
            let angle = between(random, 0.2, 0.9).to_radians();
            return NoiseSigmas {
                range_m: between(random, 2.0, 4.5),
                elevation_rad: angle,
                azimuth_rad: angle,
                range_rate_mps: between(random, 0.13, 0.3),
            };
        }
        let level = NoiseLevel::ALL[random.below(3)];
        let kind = random.unit();
        if kind < 0.15 {
            let angle = between(random, 1e-4, 0.12);
            return NoiseSigmas {
                range_m: between(random, 0.5, 120.0),
                elevation_rad: angle,
                azimuth_rad: angle * between(random, 0.5, 2.0),
                range_rate_mps: between(random, 0.008, 1.2),
            };
        }
        let table = if kind < 0.3 {
            NoiseTable::Printed
        } else {
            NoiseTable::Radians
        };
        level.sigmas(table).scaled((0.15 * random.normal()).exp())
    }
}

/// Any errors but normal and independent ones.
fn draw_errors(random: &mut RandomSource) -> Errors {
    match random.below(5) {
        0 => Errors::Quantised,
        1 => Errors::StudentT {
            degrees: random.uniform(3.0, 8.0),
        },
        2 => Errors::Glint {
            share: random.uniform(0.03, 0.15),
            factor: random.uniform(3.0, 8.0),
        },
        3 => Errors::Bias {
            part: random.uniform(0.3, 0.8),
            time_s: random.uniform(1.0, 20.0),
        },
        _ => Errors::Ranged {
            reference_m: random.uniform(20.0, 50.0),
        },
    }
}

/// Leaves channels out: the range-rate, the elevation, both distances, or by turns the angles and
/// the distances, as two sensors do. The first reading always has an azimuth.
fn leave_out(readings: &mut [Option<Reading>], random: &mut RandomSource) {
    const ANGLES: &[Channel] = &[Channel::Elevation, Channel::Azimuth];
    const DISTANCES: &[Channel] = &[Channel::Range, Channel::RangeRate];
    let by_turns = match random.below(5) {
        0 | 1 => [&[Channel::RangeRate][..]; 2],
        2 => [&[Channel::Elevation][..]; 2],
        3 => [DISTANCES; 2],
        _ => [DISTANCES, ANGLES],
    };
    for (reading, left_out) in readings.iter_mut().zip(by_turns.iter().cycle()) {
        *reading = reading.map(|reading| reading.without(left_out));
    }
}

/// Keeps every so many-th reading and misses some of those, but not the first.
fn scan(readings: &mut [Option<Reading>], random: &mut RandomSource) {
    let stride = [1, 2, 10, 4][random.below(4)];
    let detection = random.uniform(0.8, 1.0);
    for (index, reading) in readings.iter_mut().enumerate().skip(1) {
        if index % stride != 0 || !random.chance(detection) {
            *reading = None;
        }
    }
}

/// Replaces what a reading measures by a place anywhere in the sky.
fn imagine(reading: &mut Reading, range_m_max: f64, random: &mut RandomSource) {
    reading.range_m = random.uniform(0.0, range_m_max);
    reading.elevation_rad = random.uniform(0.0, core::f64::consts::FRAC_PI_4);
    reading.azimuth_rad = random.uniform(-core::f64::consts::PI, core::f64::consts::PI);
    reading.range_rate_mps = random.uniform(-30.0, 30.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::generator::{GeneratorSettings, generate};

    fn measured_shares(sensor: &Sensor) -> Vec<f64> {
        let settings = GeneratorSettings {
            flights: 1,
            ..GeneratorSettings::default()
        };
        let flight = &generate(&settings).unwrap()[0];
        let mut random = RandomSource::new(2, &[]);
        let share = |readings: Vec<Option<Reading>>| {
            assert!(readings[0].is_some());
            readings.iter().flatten().count() as f64 / readings.len() as f64
        };
        (0..200)
            .map(|_| {
                let noise = sensor.draw_noise(&mut random);
                share(sensor.readings(noise, flight, 1, &mut random))
            })
            .collect()
    }

    /// Every channel goes missing, also by turns; what is there has an azimuth first.
    #[test]
    fn channels_go_missing_and_the_first_reading_has_an_azimuth() {
        let settings = GeneratorSettings {
            flights: 1,
            ..GeneratorSettings::default()
        };
        let flight = &generate(&settings).unwrap()[0];
        let mut random = RandomSource::new(4, &[]);
        let sensor = Sensor {
            missing_share: 1.0,
            ..Sensor::PAPER
        };
        let mut counts = [0; 4];
        let mut turns = 0;
        for _ in 0..100 {
            let noise = sensor.draw_noise(&mut random);
            let readings = sensor.readings(noise, flight, 1, &mut random);
            let mut present = readings.iter().flatten().map(|r| r.vectors().present);
            let first = present.next().unwrap();
            assert_eq!(first[1], 1.0);
            for (count, present) in counts.iter_mut().zip(first) {
                *count += usize::from(present == 0.0);
            }
            turns += usize::from(present.any(|later| later != first));
            assert!(readings.iter().flatten().all(|r| r.missing().is_some()));
        }
        assert!(
            counts[0] > 5 && counts[2] > 15 && counts[3] > 40,
            "{counts:?}"
        );
        assert!(turns > 8, "{turns}");
    }

    #[test]
    fn every_rate_occurs_and_the_first_sample_is_measured() {
        let near = |shares: &[f64], wanted: f64| {
            shares.iter().filter(|s| (*s - wanted).abs() < 0.03).count()
        };
        let paper = measured_shares(&Sensor::PAPER);
        assert!(
            near(&paper, 1.0) > 40 && near(&paper, 0.53) > 40,
            "{paper:?}"
        );
        let scanned = measured_shares(&Sensor::COUNTER_UAS);
        assert!(near(&scanned, 0.1) > 20, "{scanned:?}");
        assert!(scanned.iter().any(|share| *share > 0.85));
    }
}
