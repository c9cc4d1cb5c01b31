//! Kinds of errors of a radar: how the errors of its readings are distributed.

use crate::radar::noise::NoiseSigmas;
use crate::radar::reading::Reading;
use crate::random_source::RandomSource;
use serde::{Deserialize, Serialize};

/// How errors are distributed. The standard deviations that a reading states are those of its
/// errors, but for [`Errors::Glint`] and [`Errors::Outliers`], which no
/// sensor owns up to, and [`Errors::Quantised`], whose bins add a twelfth to the variance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", tag = "kind")]
pub enum Errors {
    /// Normal, independent from reading to reading.
    #[default]
    Gaussian,
    /// Normal, and then range and range-rate fall into bins one standard deviation wide whose middle
    /// is reported, as in the paper's published code.
    Quantised,
    /// Student's t, scaled to the stated standard deviation.
    StudentT {
        /// Degrees of freedom, above 2.
        degrees: f64,
    },
    /// Normal, but a share of the readings has errors several times as wide.
    Glint {
        /// Share of such readings, 0 to 1.
        share: f64,
        /// How much wider.
        factor: f64,
    },
    /// Normal, and part of it a bias that changes slowly (a first-order Gauss-Markov process).
    Bias {
        /// Standard deviation of the bias as a part of the whole, 0 to 1.
        part: f64,
        /// Time constant of the bias, s.
        time_s: f64,
    },
    /// Normal, but in a share of the readings after the first one value is off by 5 to 50 standard
    /// deviations.
    Outliers {
        /// Share of such readings, 0 to 1.
        share: f64,
    },
    /// Normal, with all standard deviations growing with the square of the range, as the root of
    /// the signal-to-noise ratio falls; the reading states them.
    Ranged {
        /// Range at which they are the noise level's, m.
        reference_m: f64,
    },
}

/// Least and largest factor on standard deviations that grow with range.
const RANGED: [f64; 2] = [0.05, 20.0];

/// Draws the errors of one flight's readings, in units of their standard deviations.
#[derive(Clone, Debug)]
pub struct Draws {
    errors: Errors,
    bias: [f64; 4],
    bias_time_s: Option<f64>,
}

impl Errors {
    /// The errors of a flight.
    #[must_use]
    pub fn draws(self) -> Draws {
        Draws {
            errors: self,
            bias: [0.0; 4],
            bias_time_s: None,
        }
    }

    /// Factor on the standard deviations, also on those that are stated, at a range, m.
    #[must_use]
    pub fn factor(&self, range_m: f64) -> f64 {
        match self {
            Self::Ranged { reference_m } => {
                let [least, most] = RANGED;
                (range_m / reference_m).powi(2).clamp(least, most)
            }
            _ => 1.0,
        }
    }

    /// What is reported of a reading that was measured with `noise`; `first` is the flight's first.
    pub fn reported(
        &self,
        mut reading: Reading,
        noise: &NoiseSigmas,
        first: bool,
        random: &mut RandomSource,
    ) -> Reading {
        match self {
            Self::Outliers { share } => {
                if !first && random.chance(*share) {
                    spoil(&mut reading, random);
                }
                reading
            }
            Self::Quantised => Reading {
                range_m: bin_middle(reading.range_m, noise.range_m),
                range_rate_mps: bin_middle(reading.range_rate_mps, noise.range_rate_mps),
                ..reading
            },
            _ => reading,
        }
    }
}

impl Draws {
    /// Errors of range, elevation, azimuth and range-rate at a time of the flight, s.
    pub fn next(&mut self, time_s: f64, random: &mut RandomSource) -> [f64; 4] {
        match self.errors {
            Errors::Gaussian
            | Errors::Quantised
            | Errors::Outliers { .. }
            | Errors::Ranged { .. } => normals(random),
            Errors::StudentT { degrees } => {
                // Independent channels would hide the tails in the norm of four.
                let scale = (degrees - 2.0).sqrt() / chi(degrees, random);
                normals(random).map(|error| scale * error)
            }
            Errors::Glint { share, factor } => {
                let scale = if random.chance(share) { factor } else { 1.0 };
                normals(random).map(|error| scale * error)
            }
            Errors::Bias { part, time_s: slow } => {
                let kept = self
                    .bias_time_s
                    .map_or(0.0, |last| (-(time_s - last).max(0.0) / slow).exp());
                let new = (1.0 - kept * kept).sqrt();
                for bias in &mut self.bias {
                    *bias = kept * *bias + new * random.normal();
                }
                self.bias_time_s = Some(time_s);
                let white = (1.0 - part * part).max(0.0).sqrt();
                let errors = normals(random);
                core::array::from_fn(|i| part * self.bias[i] + white * errors[i])
            }
        }
    }
}

fn normals(random: &mut RandomSource) -> [f64; 4] {
    core::array::from_fn(|_| random.normal())
}

/// A draw of the chi distribution: the root of a gamma variable (Marsaglia and Tsang 2000).
fn chi(degrees: f64, random: &mut RandomSource) -> f64 {
    let d = 0.5 * degrees - 1.0 / 3.0;
    let c = 1.0 / (9.0 * d).sqrt();
    loop {
        let x = random.normal();
        let v = (1.0 + c * x).powi(3);
        if v > 0.0 && libm::log(1.0 - random.unit()) < 0.5 * x * x + d - d * v + d * libm::log(v) {
            return (2.0 * d * v).sqrt();
        }
    }
}

/// Moves one value of a reading by 5 to 50 of its standard deviations.
pub fn spoil(reading: &mut Reading, random: &mut RandomSource) {
    let sigmas = random.sign() * random.uniform(5.0, 50.0);
    match random.below(4) {
        0 => reading.range_m += sigmas * reading.sigma_range_m,
        1 => reading.elevation_rad += sigmas * reading.sigma_elevation_rad,
        2 => reading.azimuth_rad += sigmas * reading.sigma_azimuth_rad,
        _ => reading.range_rate_mps += sigmas * reading.sigma_range_rate_mps,
    }
}

/// The middle of the bin of `width` that `value` falls into; bins start at multiples of the width.
fn bin_middle(value: f64, width: f64) -> f64 {
    ((value / width).floor() + 0.5) * width
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWS: usize = 40_000;

    /// Draws 0.1 s apart.
    fn drawn(errors: Errors) -> Vec<[f64; 4]> {
        let (mut draws, mut random) = (errors.draws(), RandomSource::new(3, &[]));
        (0..DRAWS)
            .map(|i| draws.next(0.1 * i as f64, &mut random))
            .collect()
    }

    fn moment(drawn: &[[f64; 4]], of: impl Fn(f64) -> f64) -> f64 {
        let sum: f64 = drawn.iter().flatten().map(|error| of(*error)).sum();
        sum / (4 * drawn.len()) as f64
    }

    /// Every kind but glint has the deviation that it states: within five standard errors, which
    /// the tails and the bias make larger.
    #[test]
    fn deviations_are_the_stated_ones() {
        let kinds = [
            (Errors::Gaussian, 0.01),
            (Errors::StudentT { degrees: 4.5 }, 0.12),
            (
                Errors::Bias {
                    part: 0.6,
                    time_s: 3.0,
                },
                0.06,
            ),
            (Errors::Ranged { reference_m: 30.0 }, 0.01),
        ];
        for (errors, within) in kinds {
            let square = moment(&drawn(errors), |e| e * e);
            assert!((square - 1.0).abs() < within, "{errors:?}: {square}");
        }
        let glint = Errors::Glint {
            share: 0.1,
            factor: 5.0,
        };
        let square = moment(&drawn(glint), |e| e * e);
        assert!((square - (0.9 + 0.1 * 25.0)).abs() < 0.15, "{square}");
    }

    /// A t variable of five degrees is beyond three of its standard deviations in 1.2 % of draws, a
    /// normal one in 0.27 % (scipy 1.17: 2 * t.sf(3 * sqrt(5 / 3), 5) = 0.01166).
    #[test]
    fn tails_are_students() {
        let beyond = |errors| moment(&drawn(errors), |e| f64::from(u8::from(e.abs() > 3.0)));
        let (t, normal) = (
            beyond(Errors::StudentT { degrees: 5.0 }),
            beyond(Errors::Gaussian),
        );
        assert!((t - 0.01166).abs() < 0.0022, "{t}");
        assert!((normal - 0.0027).abs() < 0.0007, "{normal}");
    }

    #[test]
    fn a_bias_is_remembered_for_its_time() {
        let drawn = drawn(Errors::Bias {
            part: 0.8,
            time_s: 2.0,
        });
        let lagged = |steps: usize| {
            let pairs = drawn.iter().zip(&drawn[steps..]);
            pairs.map(|(a, b)| a[0] * b[0]).sum::<f64>() / (DRAWS - steps) as f64
        };
        for (steps, expected) in [(10, 0.64 * (-0.5_f64).exp()), (20, 0.64 * (-1.0_f64).exp())] {
            assert!(
                (lagged(steps) - expected).abs() < 0.08,
                "{steps}: {}",
                lagged(steps)
            );
        }
    }

    #[test]
    fn bins_start_at_multiples_of_their_width() {
        assert_eq!(bin_middle(34.9, 10.0), 35.0);
        assert_eq!(bin_middle(-0.1, 100.0), -50.0);
        assert_eq!(bin_middle(0.0, 100.0), 50.0);
        assert_eq!(bin_middle(40.0, 10.0), 45.0);
    }

    #[test]
    fn outliers_are_as_many_as_stated_and_never_the_first() {
        let errors = Errors::Outliers { share: 0.1 };
        let noise = crate::radar::noise::NoiseLevel::Low.sigmas(Default::default());
        let exact = Reading {
            time_us: 0,
            range_m: 30.0,
            elevation_rad: 0.3,
            azimuth_rad: 1.0,
            range_rate_mps: 0.0,
            sigma_range_m: noise.range_m,
            sigma_elevation_rad: noise.elevation_rad,
            sigma_azimuth_rad: noise.azimuth_rad,
            sigma_range_rate_mps: noise.range_rate_mps,
            sensor: crate::radar::pose::Pose::ORIGIN,
            late_us: 0,
        };
        let mut random = RandomSource::new(6, &[]);
        let mut off = |first| {
            let wrong =
                (0..5000).filter(|_| errors.reported(exact, &noise, first, &mut random) != exact);
            wrong.count()
        };
        assert_eq!(off(true), 0);
        // Four standard errors.
        assert!(off(false).abs_diff(500) < 85);
    }

    #[test]
    fn deviations_grow_with_the_square_of_the_range() {
        let errors = Errors::Ranged { reference_m: 30.0 };
        assert!((errors.factor(60.0) - 4.0).abs() < 1e-12);
        assert!((errors.factor(15.0) - 0.25).abs() < 1e-12);
        assert_eq!(errors.factor(0.0), 0.05);
        assert_eq!(Errors::Gaussian.factor(60.0), 1.0);
    }
}
