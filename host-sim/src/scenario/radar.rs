//! The simulated radar: what it measures of a flight, when, and what it only believes to see.

use std::f64::consts::PI;

use bnkf::measurement::Channel;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::errors::Errors;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseSigmas, NoiseTable};
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radars};
use bnkf_model_export::radar::sensors::Sensors;
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed;
use serde::{Deserialize, Serialize};

/// How well and how often the radar measures: one block of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// How the angle figures of the noise level are read.
    pub table: NoiseTable,
    /// Noise level of the readings.
    pub noise: NoiseLevel,
    /// Part of the samples that is measured.
    pub rate: SamplingRate,
}

/// Which samples are measured at a rate below one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// The paper's: of every tenth of a flight the first part.
    Blocks,
    /// Every so many-th: a slower scan.
    Even,
}

/// Readings that come late.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// Share of the readings.
    pub share: f64,
    /// How late they come, seconds.
    pub by_s: f64,
}

/// A radar.
#[derive(Clone, Debug, PartialEq)]
pub struct Radar {
    /// Standard deviations at low, medium and high noise. Where the table is
    /// [`NoiseTable::Printed`], the angle figures are degrees.
    pub sigmas: [NoiseSigmas; 3],
    /// The tables that are evaluated.
    pub tables: Vec<NoiseTable>,
    /// The sampling rates that are evaluated.
    pub rates: Vec<SamplingRate>,
    /// Which samples are measured.
    pub pattern: Pattern,
    /// Probability that a measured sample gives a reading.
    pub detection_probability: f64,
    /// Probability that a measured sample without a reading of the target gives a false one, or
    /// that the false one hides the true one.
    pub false_alarm_probability: f64,
    /// How errors are distributed.
    pub errors: Errors,
    /// What is not measured, by turns; with nothing here, all is.
    pub missing: Vec<Vec<Channel>>,
    /// Largest range of a false alarm, metres.
    pub range_m_max: f64,
    /// Standard deviations that readings state, over the true ones; 1 for an honest radar.
    pub stated_factor: f64,
    /// Where the radars are.
    pub sensors: Sensors,
    /// Which readings come late.
    pub late: Lateness,
}

impl Radar {
    /// The paper's radar with one reading of its noise table.
    pub fn paper(table: NoiseTable) -> Self {
        Self {
            sigmas: NoiseLevel::ALL.map(|level| level.sigmas(NoiseTable::Radians)),
            tables: vec![table],
            rates: SamplingRate::ALL.to_vec(),
            pattern: Pattern::Blocks,
            detection_probability: 1.0,
            false_alarm_probability: 0.0,
            errors: Errors::Gaussian,
            missing: Vec::new(),
            range_m_max: 50.0,
            stated_factor: 1.0,
            sensors: Sensors::Origin,
            late: Lateness::default(),
        }
    }

    /// Standard deviations of the noise, angles in radians.
    pub fn sigmas(&self, table: NoiseTable, noise: NoiseLevel) -> NoiseSigmas {
        let figures = self.sigmas[noise as usize];
        let unit_rad = match table {
            NoiseTable::Radians => 1.0,
            NoiseTable::Printed => PI / 180.0,
        };
        NoiseSigmas {
            elevation_rad: figures.elevation_rad * unit_rad,
            azimuth_rad: figures.azimuth_rad * unit_rad,
            ..figures
        }
    }

    /// Every table, noise level and rate, in this order.
    pub fn conditions(&self) -> Vec<Condition> {
        let mut conditions = Vec::new();
        for &table in &self.tables {
            for noise in NoiseLevel::ALL {
                for &rate in &self.rates {
                    conditions.push(Condition { table, noise, rate });
                }
            }
        }
        conditions
    }

    /// The readings of `flight`, one entry per sample; the first is always a true one. Depends on
    /// (seed, flight name, condition) only.
    pub fn readings(
        &self,
        flight: &Flight,
        condition: Condition,
        seed: u64,
    ) -> Vec<Option<Reading>> {
        let mut readings = self.sightings(flight, condition, seed);
        self.miss_and_mistake(flight, condition, seed, &mut readings);
        self.delay(flight, seed, &mut readings);
        readings
    }

    /// [`Self::readings`] of a radar that misses nothing and imagines nothing: what filters are tuned
    /// on.
    pub fn sightings(
        &self,
        flight: &Flight,
        condition: Condition,
        seed: u64,
    ) -> Vec<Option<Reading>> {
        let noise = self.sigmas(condition.table, condition.noise);
        let every_sample = self.pattern == Pattern::Even;
        let settings = RadarSettings {
            noise,
            errors: self.errors,
            stated: noise.scaled(self.stated_factor),
            rate: if every_sample {
                SamplingRate::FULL
            } else {
                condition.rate
            },
            gap_phase: 0,
            seed,
        };
        let stride = self.stride(condition);
        let pose = |index: usize, time_s| self.sensors.pose(index / stride, time_s);
        let mut readings = sample_radars(flight, &settings, pose);
        if every_sample {
            for (index, reading) in readings.iter_mut().enumerate() {
                if index % stride != 0 {
                    *reading = None;
                }
            }
        }
        for (index, reading) in readings.iter_mut().enumerate() {
            let missing = self.missing_at(index / stride);
            *reading = reading.map(|reading| reading.without(missing));
        }
        readings
    }

    /// Samples from one turn to the next.
    fn stride(&self, condition: Condition) -> usize {
        match self.pattern {
            Pattern::Blocks => 1,
            Pattern::Even => (1.0 / condition.rate.get()).round() as usize,
        }
    }

    /// What is not measured at the `turn`-th turn.
    fn missing_at(&self, turn: usize) -> &[Channel] {
        match self.missing.len() {
            0 => &[],
            turns => &self.missing[turn % turns],
        }
    }

    /// Lets readings come late, but not the first; the same samples' at every condition.
    fn delay(&self, flight: &Flight, seed: u64, readings: &mut [Option<Reading>]) {
        let ids = [seed::name_id("delay"), seed::name_id(&flight.name)];
        let mut random = RandomSource::new(seed, &ids);
        let late_us = (self.late.by_s * 1e6).round() as u64;
        for reading in readings.iter_mut().skip(1) {
            let is_late = random.chance(self.late.share);
            if let Some(reading) = reading.as_mut().filter(|_| is_late) {
                reading.late_us = late_us;
            }
        }
    }

    /// Takes readings away and puts false ones in their place.
    fn miss_and_mistake(
        &self,
        flight: &Flight,
        condition: Condition,
        seed: u64,
        readings: &mut [Option<Reading>],
    ) {
        let ids = [
            seed::name_id("detection"),
            seed::name_id(&flight.name),
            condition.table as u64,
            condition.noise as u64,
            condition.rate.get().to_bits(),
        ];
        let mut random = RandomSource::new(seed, &ids);
        let stride = self.stride(condition);
        for (index, reading) in readings.iter_mut().enumerate().skip(1) {
            let Some(found) = reading else { continue };
            let detected = random.chance(self.detection_probability);
            let mistaken = random.chance(self.false_alarm_probability);
            // Drawn whether used or not: one probability does not shift the stream of the other.
            let false_alarm = Reading {
                range_m: random.uniform(0.0, self.range_m_max),
                elevation_rad: random.uniform(0.0, 0.25 * PI),
                azimuth_rad: random.uniform(-PI, PI),
                range_rate_mps: random.uniform(-30.0, 30.0),
                ..*found
            };
            if mistaken {
                *reading = Some(false_alarm.without(self.missing_at(index / stride)));
            } else if !detected {
                *reading = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};
    use bnkf_model_export::radar::sensors::Sensors;

    use super::{Condition, Pattern, Radar};

    /// Radars take turns by scans, not by samples: a slower scan does not leave one of them out.
    #[test]
    fn turns_are_counted_in_scans() {
        let radar = Radar {
            pattern: Pattern::Even,
            sensors: Sensors::ByTurns(vec![[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
            ..Radar::paper(NoiseTable::Radians)
        };
        let readings = radar.readings(&flight(), HALF, 1);
        let places = readings.iter().flatten().map(|r| r.sensor.position_m[0]);
        let expected = [1.0, 2.0].into_iter().cycle().take(places.clone().count());
        assert!(places.clone().count() > 3 && places.eq(expected));
    }

    fn flight() -> Flight {
        let row = |i: i32| [0.1 * f64::from(i), 20.0, 10.0, 5.0];
        Flight::from_track("still", "still", &(0..2000).map(row).collect::<Vec<_>>()).unwrap()
    }

    const HALF: Condition = Condition {
        table: NoiseTable::Printed,
        noise: NoiseLevel::Medium,
        rate: SamplingRate::HALF,
    };

    #[test]
    fn the_papers_radar_adds_nothing_to_the_papers_sampling() {
        let radar = Radar::paper(NoiseTable::Printed);
        let settings = RadarSettings::paper(HALF.noise, HALF.table, HALF.rate, 4);
        let (ours, plain) = (
            radar.readings(&flight(), HALF, 4),
            sample_radar(&flight(), &settings),
        );
        assert_eq!(ours, plain);
        let conditions = radar.conditions();
        assert_eq!(conditions.len(), 9);
        assert_eq!(
            conditions[4],
            Condition {
                rate: SamplingRate::THREE_QUARTERS,
                ..HALF
            }
        );
    }

    #[test]
    fn a_slow_scan_measures_evenly() {
        let radar = Radar {
            pattern: Pattern::Even,
            ..Radar::paper(NoiseTable::Radians)
        };
        let condition = Condition {
            rate: SamplingRate::new(0.1).unwrap(),
            ..HALF
        };
        for (index, reading) in radar.readings(&flight(), condition, 1).iter().enumerate() {
            assert_eq!(reading.is_some(), index % 10 == 0, "sample {index}");
        }
    }

    /// Four standard errors of a fraction of 2000 are below 4%.
    #[test]
    fn misses_and_false_alarms_come_as_often_as_stated() {
        let radar = Radar {
            detection_probability: 0.8,
            false_alarm_probability: 0.1,
            range_m_max: 1000.0,
            ..Radar::paper(NoiseTable::Radians)
        };
        let condition = Condition {
            rate: SamplingRate::FULL,
            ..HALF
        };
        let readings = radar.readings(&flight(), condition, 1);
        assert!(readings[0].is_some());
        let seen = readings.iter().flatten().count() as f64 / 2000.0;
        assert!((seen - (0.1 + 0.9 * 0.8)).abs() < 0.04, "{seen}");
        let far = readings
            .iter()
            .flatten()
            .filter(|reading| reading.range_m > 100.0);
        let wrong = far.count() as f64 / 2000.0;
        assert!((wrong - 0.1 * 0.9).abs() < 0.03, "{wrong}");
    }

    #[test]
    fn mis_stated_sigmas_change_the_statement_and_not_the_noise() {
        let honest = Radar::paper(NoiseTable::Radians);
        let boaster = Radar {
            stated_factor: 0.5,
            ..honest.clone()
        };
        let (a, b) = (
            honest.readings(&flight(), HALF, 1),
            boaster.readings(&flight(), HALF, 1),
        );
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert_eq!(a.range_m, b.range_m);
            assert_eq!(b.sigma_range_m, 0.5 * a.sigma_range_m);
        }
    }
}
