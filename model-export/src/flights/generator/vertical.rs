//! What makes a level course three-dimensional.

use super::reference::Reference;
use crate::random_source::RandomSource;
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;

/// The third dimension of a course.
#[derive(Clone, Copy, Debug)]
pub enum Vertical {
    /// Constant height.
    Level,
    /// The whole course turned about a horizontal axis.
    Tilted { rotation: Rotation3<f64> },
    /// Height swings sinusoidally.
    Oscillating {
        amplitude_m: f64,
        rate_rad_per_s: f64,
        phase_rad: f64,
    },
    /// Steady climb, or descent if negative.
    Climbing { climb_mps: f64 },
}

impl Vertical {
    /// `rate_rad_per_s` is the course's own; a climb gains at most 10 m in `duration_s`.
    pub fn draw(random: &mut RandomSource, rate_rad_per_s: f64, duration_s: f64) -> Self {
        let choice = random.unit();
        if choice < 0.3 {
            Self::Level
        } else if choice < 0.55 {
            let (sine, cosine) = libm::sincos(random.uniform(0.0, TAU));
            let (tilt_sine, tilt_cosine) = libm::sincos(random.uniform(0.1, 0.8));
            Self::Tilted {
                rotation: rotation([cosine, sine], tilt_sine, tilt_cosine),
            }
        } else if choice < 0.8 {
            Self::Oscillating {
                amplitude_m: random.uniform(0.3, 2.5),
                rate_rad_per_s: rate_rad_per_s * random.uniform(0.3, 2.0),
                phase_rad: random.uniform(0.0, TAU),
            }
        } else {
            let climb_mps = random.uniform(0.1, 0.7).min(10.0 / duration_s);
            Self::Climbing {
                climb_mps: random.sign() * climb_mps,
            }
        }
    }

    /// Part of the flight's name.
    pub fn suffix(&self) -> &'static str {
        match self {
            Self::Level => "",
            Self::Tilted { .. } => "-tilted",
            Self::Oscillating { .. } => "-oscillating",
            Self::Climbing { .. } => "-climbing",
        }
    }

    pub fn apply(&self, level: Reference, t_s: f64) -> Reference {
        let raised = |height_m, climb_mps, lift_mps2| Reference {
            position_m: level.position_m + Vector3::z() * height_m,
            velocity_mps: level.velocity_mps + Vector3::z() * climb_mps,
            acceleration_mps2: level.acceleration_mps2 + Vector3::z() * lift_mps2,
        };
        match *self {
            Self::Level => level,
            Self::Tilted { rotation } => Reference {
                position_m: rotation * level.position_m,
                velocity_mps: rotation * level.velocity_mps,
                acceleration_mps2: rotation * level.acceleration_mps2,
            },
            Self::Oscillating {
                amplitude_m,
                rate_rad_per_s: w,
                phase_rad,
            } => {
                let (sine, cosine) = libm::sincos(w * t_s + phase_rad);
                raised(
                    amplitude_m * sine,
                    amplitude_m * w * cosine,
                    -amplitude_m * w * w * sine,
                )
            }
            Self::Climbing { climb_mps } => raised(climb_mps * t_s, climb_mps, 0.0),
        }
    }
}

/// Turn about the horizontal unit axis by the angle with this sine and cosine (Rodrigues).
fn rotation([x, y]: [f64; 2], sine: f64, cosine: f64) -> Rotation3<f64> {
    let rest = 1.0 - cosine;
    Rotation3::from_matrix_unchecked(nalgebra::Matrix3::new(
        cosine + x * x * rest,
        x * y * rest,
        y * sine,
        x * y * rest,
        cosine + y * y * rest,
        -x * sine,
        -y * sine,
        x * sine,
        cosine,
    ))
}

#[cfg(test)]
mod tests {
    use super::{Reference, Vertical};
    use crate::flights::generator::circle::Circle;
    use crate::random_source::RandomSource;
    use proptest::prelude::*;
    use std::collections::HashSet;

    const CIRCLE: Circle = Circle {
        semi_axes_m: [5.0, 4.0],
        rate_rad_per_s: 0.5,
        phase_rad: 1.0,
    };

    #[test]
    fn every_variant_is_drawn() {
        let mut random = RandomSource::new(1, &[]);
        let drawn: HashSet<&str> = (0..100)
            .map(|_| Vertical::draw(&mut random, 0.5, 15.0).suffix())
            .collect();
        assert_eq!(drawn.len(), 4);
    }

    proptest! {
        #[test]
        fn the_derivatives_agree_and_heights_stay_bounded(
            seed in any::<u64>(), t_s in 0.0..15.0_f64
        ) {
            let vertical = Vertical::draw(&mut RandomSource::new(seed, &[]), 0.5, 15.0);
            let at = |t| vertical.apply(CIRCLE.at(t), t);
            Reference::assert_consistent(at, t_s);
            prop_assert!(at(t_s).position_m.z.abs() <= 10.5);
            if let Vertical::Tilted { .. } = vertical {
                let (level, tilted) = (CIRCLE.at(t_s).position_m, at(t_s).position_m);
                prop_assert!((level.norm() - tilted.norm()).abs() < 1e-12);
            }
        }
    }
}
