//! What the radar reports of a flight: exact polar values plus errors, with gaps.
//!
//! Transcendental functions come from `libm`, so a seed gives the same readings on every machine.
//! Nothing here panics.

use crate::flights::flight::Flight;
use crate::radar::errors::Errors;
use crate::radar::gaps::{self, SamplingRate};
use crate::radar::noise::{NoiseLevel, NoiseSigmas, NoiseTable};
pub use crate::radar::polar::Polar;
use crate::radar::polar::wrap_azimuth;
use crate::radar::pose::Pose;
use crate::radar::reading::Reading;
use crate::random_source::RandomSource;
use crate::seed;

/// How the radar samples a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarSettings {
    /// Standard deviations of the noise that is added.
    pub noise: NoiseSigmas,
    /// How it is distributed.
    pub errors: Errors,
    /// Standard deviations that the readings state; equal to `noise` for an honest radar.
    pub stated: NoiseSigmas,
    /// The part of the samples that is measured.
    pub rate: SamplingRate,
    /// How far into the gap pattern the flight starts, samples.
    pub gap_phase: usize,
    /// Seed of the noise.
    pub seed: u64,
}

impl RadarSettings {
    /// An honest radar with one of the paper's noise levels.
    #[must_use]
    pub fn paper(level: NoiseLevel, table: NoiseTable, rate: SamplingRate, seed: u64) -> Self {
        let noise = level.sigmas(table);
        Self {
            noise,
            errors: Errors::Gaussian,
            stated: noise,
            rate,
            gap_phase: 0,
            seed,
        }
    }
}

/// The readings of one flight by a radar in the origin, one entry per sample, `None` in gaps.
///
/// See [`sample_radars`].
#[must_use]
pub fn sample_radar(flight: &Flight, settings: &RadarSettings) -> Vec<Option<Reading>> {
    sample_radars(flight, settings, |_, _| Pose::ORIGIN)
}

/// The readings of one flight, one entry per sample, `None` in gaps; `pose` is the radar that measures
/// the sample of this number, so many seconds after the first.
///
/// The noise belongs to (seed, flight name, noise, rate): the order of flights, the number of
/// threads and other flights do not change it, and different cells draw different noise.
#[must_use]
pub fn sample_radars(
    flight: &Flight,
    settings: &RadarSettings,
    pose: impl Fn(usize, f64) -> Pose,
) -> Vec<Option<Reading>> {
    let noise = &settings.noise;
    let start_s = flight.samples.first().map_or(0.0, |first| first.time_s);
    let mut random = RandomSource::new(
        settings.seed,
        &[
            seed::name_id("radar"),
            seed::name_id(&flight.name),
            noise.range_m.to_bits(),
            noise.elevation_rad.to_bits(),
            noise.azimuth_rad.to_bits(),
            noise.range_rate_mps.to_bits(),
            settings.rate.get().to_bits(),
        ],
    );
    let measured = gaps::measured_from(flight.samples.len(), settings.rate, settings.gap_phase);
    let mut draws = settings.errors.draws();
    flight
        .samples
        .iter()
        .zip(measured)
        .enumerate()
        .map(|(index, (sample, measured))| {
            if !measured {
                return None;
            }
            let sensor = pose(index, sample.time_s - start_s);
            let exact = sensor.polar(sample.position_m, sample.velocity_mps);
            let factor = settings.errors.factor(exact.range_m);
            let (noise, stated) = (noise.scaled(factor), settings.stated.scaled(factor));
            let [range, elevation, azimuth, range_rate] = draws.next(sample.time_s, &mut random);
            let reading = Reading {
                time_us: time_us(flight, sample.time_s),
                range_m: exact.range_m + noise.range_m * range,
                elevation_rad: exact.elevation_rad + noise.elevation_rad * elevation,
                azimuth_rad: wrap_azimuth(exact.azimuth_rad + noise.azimuth_rad * azimuth),
                range_rate_mps: exact.range_rate_mps + noise.range_rate_mps * range_rate,
                sigma_range_m: stated.range_m,
                sigma_elevation_rad: stated.elevation_rad,
                sigma_azimuth_rad: stated.azimuth_rad,
                sigma_range_rate_mps: stated.range_rate_mps,
                sensor,
                late_us: 0,
            };
            Some(
                settings
                    .errors
                    .reported(reading, &noise, index == 0, &mut random),
            )
        })
        .collect()
}

/// Microseconds from the flight's first sample to `time_s`, rounded; 0 for an earlier time.
#[must_use]
pub fn time_us(flight: &Flight, time_s: f64) -> u64 {
    let start_s = flight.samples.first().map_or(0.0, |first| first.time_s);
    // A float-to-integer cast saturates, so no time can wrap round.
    ((time_s - start_s) * 1e6).round() as u64
}

#[cfg(test)]
mod tests {
    use super::{Polar, RadarSettings, sample_radar, time_us, wrap_azimuth};
    use crate::flights::flight::Flight;
    use crate::radar::gaps::SamplingRate;
    use crate::radar::noise::{NoiseLevel, NoiseTable};
    use crate::radar::reading::Reading;
    use proptest::prelude::*;

    fn hovering(name: &str, samples: usize) -> Flight {
        let rows: Vec<[f64; 4]> = (0..samples)
            .map(|i| [1.7e9 + i as f64 * 0.1, -30.0, 0.01, 10.0])
            .collect();
        Flight::from_track(name, name, &rows).unwrap()
    }

    #[test]
    fn noise_has_the_stated_size_and_no_bias() {
        let flight = hovering("hover", 20_000);
        for level in NoiseLevel::ALL {
            let settings = RadarSettings::paper(level, NoiseTable::Radians, SamplingRate::FULL, 7);
            let exact = Polar::of([-30.0, 0.01, 10.0], [0.0; 3]);
            let readings: Vec<_> = sample_radar(&flight, &settings)
                .into_iter()
                .flatten()
                .collect();
            assert_eq!(readings.len(), 20_000);
            let errors = |f: &dyn Fn(&Reading) -> f64| -> (f64, f64) {
                let n = readings.len() as f64;
                let mean = readings.iter().map(f).sum::<f64>() / n;
                let square = readings.iter().map(|r| f(r).powi(2)).sum::<f64>() / n;
                (mean, square.sqrt())
            };
            let s = settings.noise;
            let checks = [
                (
                    errors(&|r| (r.range_m - exact.range_m) / s.range_m),
                    "range",
                ),
                (
                    errors(&|r| (r.elevation_rad - exact.elevation_rad) / s.elevation_rad),
                    "elevation",
                ),
                (
                    // The flight sits on the cut at pi: the error is wrapped, the value too.
                    errors(&|r| wrap_azimuth(r.azimuth_rad - exact.azimuth_rad) / s.azimuth_rad),
                    "azimuth",
                ),
                (
                    errors(&|r| r.range_rate_mps / s.range_rate_mps),
                    "range-rate",
                ),
            ];
            for ((mean, rms), field) in checks {
                // Five standard errors of 20,000 draws.
                assert!(mean.abs() < 0.036, "{level} {field} mean {mean}");
                assert!((rms - 1.0).abs() < 0.026, "{level} {field} rms {rms}");
            }
            assert!(readings.iter().any(|r| r.azimuth_rad < 0.0));
        }
    }

    #[test]
    fn time_counts_microseconds_from_the_first_sample() {
        let flight = hovering("hover", 5);
        let readings = sample_radar(
            &flight,
            &RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, SamplingRate::FULL, 1),
        );
        let times: Vec<u64> = readings.iter().flatten().map(|r| r.time_us).collect();
        assert_eq!(times, [0, 100_000, 200_000, 300_000, 400_000]);
        assert_eq!(time_us(&flight, -1.0), 0);
    }

    #[test]
    fn readings_depend_on_identity_and_not_on_order() {
        let settings =
            |rate, seed| RadarSettings::paper(NoiseLevel::High, NoiseTable::Radians, rate, seed);
        let (a, b) = (hovering("a", 40), hovering("b", 40));
        let base = sample_radar(&a, &settings(SamplingRate::FULL, 1));
        assert_ne!(base, sample_radar(&b, &settings(SamplingRate::FULL, 1)));
        assert_eq!(base, sample_radar(&a, &settings(SamplingRate::FULL, 1)));
        assert_ne!(base, sample_radar(&a, &settings(SamplingRate::FULL, 2)));
        let half = sample_radar(&a, &settings(SamplingRate::HALF, 1));
        assert_ne!(base[0], half[0]);
        assert!(half[1].is_some());
        assert_eq!(half[2..4], [None, None]);
    }

    #[test]
    fn a_dishonest_radar_states_other_sigmas_and_reports_the_same_values() {
        let honest = RadarSettings::paper(
            NoiseLevel::Medium,
            NoiseTable::Radians,
            SamplingRate::FULL,
            3,
        );
        let dishonest = RadarSettings {
            stated: honest.noise.scaled(2.0),
            ..honest
        };
        let flight = hovering("a", 10);
        let pairs = sample_radar(&flight, &honest)
            .into_iter()
            .zip(sample_radar(&flight, &dishonest));
        for (one, two) in pairs {
            let (one, two) = (one.unwrap(), two.unwrap());
            assert_eq!(one.range_m, two.range_m);
            assert_eq!(two.sigma_range_m, 20.0);
            assert_eq!(two.sigma_azimuth_rad, 2.0 * one.sigma_azimuth_rad);
            assert_eq!(two.sigma_elevation_rad, 2.0 * one.sigma_elevation_rad);
            assert_eq!(two.sigma_range_rate_mps, 2.0 * one.sigma_range_rate_mps);
        }
    }

    proptest! {
        #[test]
        fn every_reading_is_a_measurement_the_firmware_accepts(
            p in prop::array::uniform3(-50.0..50.0_f64), seed in any::<u64>()
        ) {
            let rows: Vec<[f64; 4]> =
                (0..12).map(|i| [f64::from(i) * 0.1, p[0], p[1], p[2]]).collect();
            let flight = Flight::from_track("p", "p", &rows).unwrap();
            for level in NoiseLevel::ALL {
                let settings =
                    RadarSettings::paper(level, NoiseTable::Printed, SamplingRate::FULL, seed);
                for reading in sample_radar(&flight, &settings).iter().flatten() {
                    prop_assert_eq!(bnkf::Measurement::from(reading).check(), Ok(()));
                }
            }
        }
    }
}
