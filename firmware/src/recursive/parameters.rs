//! What a recursive blob says beside its network, in the order of the blob.

use super::envelope::Bounds;
use super::foresight::BEND_WHOLE;
use super::hypotheses::{Hypotheses, Manoeuvre};
use super::population::{Base, Population};
use crate::blob::Floats;
use crate::blob::field::{RECURSIVE_PARAMETERS, RECURSIVE_PARAMETERS_BEFORE};
use crate::scalar::Scalar;

/// Everything that surrounds the network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters<S> {
    /// Where and how fast targets are before anything is measured.
    pub population: Population<S>,
    /// The motion model of a network that answers zero.
    pub base: Base<S>,
    /// What the network was trained for.
    pub bounds: Bounds<S>,
    /// How a target may differ.
    pub hypotheses: Hypotheses<S>,
    /// How much of what acceleration adds to a forecast comes true, before a track has learned its own.
    pub bend: S,
}

impl Parameters<f64> {
    /// Small drones within 50 m, for a tracker without training.
    pub const PAPER: Self = Self {
        population: Population::PAPER,
        base: Base::DRONE,
        bounds: Bounds::PAPER,
        hypotheses: Hypotheses::DRONE,
        bend: BEND_WHOLE,
    };

    /// The numbers as a blob holds them: without those that blobs of before could not hold, where they
    /// are what was true then.
    pub fn list(&self) -> heapless::Vec<f32, RECURSIVE_PARAMETERS> {
        let (p, base, bounds) = (&self.population, &self.base, &self.bounds);
        let head = [
            p.range_m,
            p.range_sigma_m,
            p.elevation_rad,
            p.elevation_sigma_rad,
            p.horizontal_sigma_mps,
            p.vertical_sigma_mps,
            p.acceleration_sigma_mps2,
            base.decay_hz,
            base.jerk_noise,
            base.acceleration_noise,
            base.velocity_noise,
            p.horizontal_m,
            p.horizontal_sigma_m,
            p.height_m,
            p.height_sigma_m,
            bounds.speed_max_mps,
            bounds.acceleration_max_mps2,
            bounds.range_m[0],
            bounds.range_m[1],
            bounds.elevation_rad[0],
            bounds.elevation_rad[1],
            self.hypotheses.confidence,
        ];
        let h = &self.hypotheses;
        let manoeuvres = h.manoeuvres.iter();
        let tail = manoeuvres.flat_map(|m| [m.prior, m.jerk, m.acceleration, m.velocity]);
        let tail = tail.chain([h.outlier, h.outlier_variance, self.bend]);
        let count = if self.bend == BEND_WHOLE {
            RECURSIVE_PARAMETERS_BEFORE
        } else {
            RECURSIVE_PARAMETERS
        };
        let list = head.into_iter().chain(tail).take(count);
        list.map(|value| value as f32).collect()
    }
}

impl<S: Scalar + From<f32>> Parameters<S> {
    /// Those of a recursive blob.
    pub fn read(parameters: Floats<'_>) -> Self {
        // Of a length that the compiler knows: nothing is checked again for every number.
        let missing = &[f32::NAN.to_le_bytes(); RECURSIVE_PARAMETERS_BEFORE];
        let first = parameters.bytes().first_chunk().unwrap_or(missing);
        let p = |index: usize| S::from(f32::from_le_bytes(first[index]));
        Self {
            population: Population {
                range_m: p(0),
                range_sigma_m: p(1),
                elevation_rad: p(2),
                elevation_sigma_rad: p(3),
                horizontal_sigma_mps: p(4),
                vertical_sigma_mps: p(5),
                acceleration_sigma_mps2: p(6),
                horizontal_m: p(11),
                horizontal_sigma_m: p(12),
                height_m: p(13),
                height_sigma_m: p(14),
            },
            base: Base {
                decay_hz: p(7),
                jerk_noise: p(8),
                acceleration_noise: p(9),
                velocity_noise: p(10),
            },
            bounds: Bounds {
                speed_max_mps: p(15),
                acceleration_max_mps2: p(16),
                range_m: [p(17), p(18)],
                elevation_rad: [p(19), p(20)],
            },
            hypotheses: Hypotheses {
                confidence: p(21),
                manoeuvres: core::array::from_fn(|k| {
                    let at = 22 + 4 * k;
                    Manoeuvre {
                        prior: p(at),
                        jerk: p(at + 1),
                        acceleration: p(at + 2),
                        velocity: p(at + 3),
                    }
                }),
                outlier: p(30),
                outlier_variance: p(31),
            },
            bend: match parameters.iter().nth(RECURSIVE_PARAMETERS_BEFORE) {
                Some(bend) => S::from(bend),
                None => S::constant(BEND_WHOLE),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_come_back() {
        let mut given = Parameters::PAPER;
        // Numbers that are exact in single precision, each of its own.
        given.population.height_m = 15.25;
        given.bounds.elevation_rad = [-1.5, 1.25];
        for (k, manoeuvre) in given.hypotheses.manoeuvres.iter_mut().enumerate() {
            let k = k as f64;
            *manoeuvre = Manoeuvre {
                prior: 0.25 / (1.0 + k),
                jerk: 2.0 + k,
                acceleration: 16.0 + k,
                velocity: 32.0 + k,
            };
        }
        given.hypotheses.outlier = 0.0625;
        given.hypotheses.outlier_variance = 128.0;
        let mut draft = crate::blob::draft::Draft::recursive(3);
        // A blob that was written before forecasts had a prior of their own, and one that has it.
        for (bend, version, count) in [(1.0, 2, 32), (0.375, 4, 33)] {
            given.bend = bend;
            let list = given.list();
            assert_eq!(list.len(), count);
            draft.parameters = list.to_vec();
            let bytes = draft.bytes();
            let blob = crate::blob::Blob::parse(&bytes).expect("a blob");
            assert_eq!(blob.version(), version);
            let back = Parameters::<f64>::read(blob.parameters());
            assert_eq!((back.list(), back.bend), (list, bend));
        }
        let bytes = draft.bytes();
        let blob = crate::blob::Blob::parse(&bytes).expect("a blob");
        let back = Parameters::<f64>::read(blob.parameters());
        assert_eq!(back.population.height_m, 15.25);
        assert_eq!(back.bounds.elevation_rad, [-1.5, 1.25]);
        assert_eq!(back.hypotheses, given.hypotheses);
        assert!((back.base.velocity_noise - 1e-4).abs() < 1e-10);
    }
}
