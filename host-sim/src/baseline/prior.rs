//! What is known of a flight before it is seen: the population of training flights.

use bnkf::radar;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::polar::Polar;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::gaussian::{Gaussian, symmetric};
use super::sensor::{Observation, cartesian};
use crate::filter::PositionEstimate;

/// A mean and a standard deviation of one quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, above zero.
    pub sigma: f64,
}

/// Where drones are and how fast they move, over every sample of the training flights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PopulationPrior {
    /// Distance to the radar, m.
    pub range_m: Normal,
    /// Elevation, rad.
    pub elevation_rad: Normal,
    /// Standard deviation of the velocity on each horizontal axis about zero, m/s.
    pub velocity_horizontal_sigma_mps: f64,
    /// Standard deviation of the vertical velocity about zero, m/s.
    pub velocity_vertical_sigma_mps: f64,
    /// Mean position, m.
    pub position_mean_m: [f64; 3],
    /// Covariance of the position, m^2.
    pub position_covariance_m2: [[f64; 3]; 3],
}

/// Standard deviations are not taken to be smaller than this [m, rad, m/s]: flights that agree
/// too well would make covariances singular.
const SIGMA_MIN: f64 = 1e-3;

/// Why there is no prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PriorError {
    /// Fewer than two samples in all flights together.
    #[error("{0} samples in the training flights, at least 2 are needed")]
    TooFewSamples(usize),
    /// A position or velocity is not finite, or so large that its square is not.
    #[error("the training flights hold values that are not finite or too large")]
    NotFinite,
}

impl Normal {
    fn fit(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        Self {
            mean,
            sigma: variance.sqrt().max(SIGMA_MIN),
        }
    }

    /// The posterior after an independent reading `z` with standard deviation `sigma`.
    pub(super) fn fused(&self, z: f64, sigma: f64) -> Self {
        let gain = self.sigma.powi(2) / (self.sigma.powi(2) + sigma.powi(2));
        Self {
            mean: self.mean + gain * (z - self.mean),
            sigma: sigma * gain.sqrt(),
        }
    }
}

impl Observation {
    /// A component fused with what is known of it, which is all if it was not measured.
    fn fused(&self, component: usize, known: &Normal) -> Normal {
        match self.present[component] {
            true => known.fused(self.z[component], self.sigma[component]),
            false => *known,
        }
    }
}

impl PopulationPrior {
    /// Moments over all samples of `flights`, each sample with the same weight.
    ///
    /// # Errors
    /// See [`PriorError`].
    pub fn fit<'a>(flights: impl IntoIterator<Item = &'a Flight>) -> Result<Self, PriorError> {
        let samples: Vec<_> = flights.into_iter().flat_map(|f| &f.samples).collect();
        let n = samples.len() as f64;
        if samples.len() < 2 {
            return Err(PriorError::TooFewSamples(samples.len()));
        }
        let positions: Vec<_> = samples
            .iter()
            .map(|s| Vector3::from(s.position_m))
            .collect();
        let polar = || {
            samples
                .iter()
                .map(|s| Polar::of(s.position_m, s.velocity_mps))
        };
        let ranges: Vec<_> = polar().map(|p| p.range_m).collect();
        let elevations: Vec<_> = polar().map(|p| p.elevation_rad).collect();
        let mean = positions.iter().sum::<Vector3<f64>>() / n;
        let covariance = positions
            .iter()
            .map(|p| (p - mean) * (p - mean).transpose())
            .sum::<Matrix3<f64>>()
            / n
            + Matrix3::identity() * SIGMA_MIN.powi(2);
        let square = |axis: usize| {
            samples
                .iter()
                .map(|s| s.velocity_mps[axis].powi(2))
                .sum::<f64>()
                / n
        };
        let prior = Self {
            range_m: Normal::fit(&ranges),
            elevation_rad: Normal::fit(&elevations),
            velocity_horizontal_sigma_mps: (0.5 * (square(0) + square(1))).sqrt().max(SIGMA_MIN),
            velocity_vertical_sigma_mps: square(2).sqrt().max(SIGMA_MIN),
            position_mean_m: mean.into(),
            position_covariance_m2: covariance.into(),
        };
        let horizontal = prior.velocity_horizontal_sigma_mps;
        let sum = covariance.sum() + horizontal + prior.velocity_vertical_sigma_mps;
        if sum.is_finite() {
            Ok(prior)
        } else {
            Err(PriorError::NotFinite)
        }
    }

    /// Range of one reading fused with the population's, m; what the population says of places it says
    /// of them as the reading's radar sees them.
    pub fn fused_range(&self, observation: &Observation) -> Normal {
        observation.fused(2, &self.range_m)
    }

    /// Range and elevation of one reading fused with the population's, azimuth as read, carried
    /// to Cartesian coordinates by the unscented transform.
    pub fn fused_position(&self, observation: &Observation) -> PositionEstimate {
        self.position_at_range(observation, &self.fused_range(observation))
    }

    fn position_at_range(&self, observation: &Observation, range: &Normal) -> PositionEstimate {
        let (z, sigma) = (&observation.z, &observation.sigma);
        let elevation = observation.fused(0, &self.elevation_rad);
        let centre = Vector3::new(elevation.mean, z[1], range.mean);
        // Six points at sqrt(3) sigma, each with weight 1/6: the spherical cubature rule.
        let reach = Vector3::new(elevation.sigma, sigma[1], range.sigma) * 3.0_f64.sqrt();
        let points: [Vector3<f64>; 6] = core::array::from_fn(|i| {
            let mut point = centre;
            point[i / 2] += if i % 2 == 0 {
                reach[i / 2]
            } else {
                -reach[i / 2]
            };
            cartesian(point[0], point[1], point[2])
        });
        let mean = points.iter().sum::<Vector3<f64>>() / 6.0;
        let covariance = points
            .iter()
            .map(|p| (p - mean) * (p - mean).transpose())
            .sum::<Matrix3<f64>>()
            / 6.0;
        PositionEstimate::new(mean + observation.position_m, symmetric(&covariance))
    }

    /// [`Self::fused_position`] with the population's velocity, corrected by the range-rate.
    pub fn belief(&self, observation: &Observation) -> Gaussian<6> {
        self.belief_at_range(observation, &self.fused_range(observation))
    }

    /// [`Self::belief`] with this range instead of what the reading and the population say of it.
    pub fn belief_at_range(&self, observation: &Observation, range: &Normal) -> Gaussian<6> {
        let position = self.position_at_range(observation, range);
        let p = position.position_m;
        let (across, up) = (
            self.velocity_horizontal_sigma_mps,
            self.velocity_vertical_sigma_mps,
        );
        let velocity_variance = Vector3::new(across, across, up).map(|sigma| sigma * sigma);
        let prior = Matrix3::from_diagonal(&velocity_variance);
        let seen = p - observation.position_m;
        let sight = Vector3::from(radar::predict(seen.into(), [0.0; 3]).by_velocity);
        let cross = prior * sight;
        // The radar's own motion comes off the range-rate, along a direction that is not known well.
        let own = observation.velocity_mps;
        let across = (own - sight * sight.dot(&own)) / seen.norm().max(f64::MIN_POSITIVE);
        let unsure = across.dot(&(position.covariance_m2 * across));
        let unsure = unsure.min(own.norm_squared());
        let gain = match observation.present[3] {
            true => cross / (sight.dot(&cross) + observation.sigma[3].powi(2) + unsure),
            false => Vector3::zeros(),
        };
        let velocity = gain * (observation.z[3] + sight.dot(&own));
        let velocity_covariance = symmetric(&(prior - gain * cross.transpose()));
        let mut covariance = Matrix6::zeros();
        covariance
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&position.covariance_m2);
        covariance
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&velocity_covariance);
        let mean = Vector6::new(p.x, p.y, p.z, velocity.x, velocity.y, velocity.z);
        Gaussian { mean, covariance }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::baseline::sensor::expected;
    use bnkf_model_export::random_source::RandomSource;

    /// The paper's volume, roughly.
    pub(in crate::baseline) const PRIOR: PopulationPrior = PopulationPrior {
        range_m: Normal {
            mean: 34.0,
            sigma: 6.0,
        },
        elevation_rad: Normal {
            mean: 0.48,
            sigma: 0.22,
        },
        velocity_horizontal_sigma_mps: 1.7,
        velocity_vertical_sigma_mps: 0.6,
        position_mean_m: [0.5, -1.0, 14.0],
        position_covariance_m2: [[480.0, 0.0, 0.0], [0.0, 480.0, 0.0], [0.0, 0.0, 27.0]],
    };

    fn flight(rows: &[[f64; 4]]) -> Flight {
        Flight::from_track("f", "f", rows).unwrap()
    }

    #[test]
    fn moments_by_hand() {
        let f = flight(&[
            [0.0, 3.0, 4.0, 0.0],
            [1.0, 6.0, 8.0, 0.0],
            [2.0, 9.0, 12.0, 0.0],
        ]);
        let prior = PopulationPrior::fit([&f]).unwrap();
        assert!((prior.range_m.mean - 10.0).abs() < 1e-12);
        assert!((prior.range_m.sigma - (50.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(
            prior.elevation_rad,
            Normal {
                mean: 0.0,
                sigma: SIGMA_MIN
            }
        );
        // Velocity (3, 4, 0) throughout.
        assert!((prior.velocity_horizontal_sigma_mps - 12.5_f64.sqrt()).abs() < 1e-12);
        assert_eq!(prior.velocity_vertical_sigma_mps, SIGMA_MIN);
        assert_eq!(prior.position_mean_m, [6.0, 8.0, 0.0]);
        assert!((prior.position_covariance_m2[0][1] - 8.0).abs() < 1e-12);
        assert!(
            Matrix3::from(prior.position_covariance_m2)
                .cholesky()
                .is_some()
        );
    }

    #[test]
    fn no_samples_or_huge_ones_are_refused() {
        assert_eq!(PopulationPrior::fit([]), Err(PriorError::TooFewSamples(0)));
        let mut f = flight(&[
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 1.0, 2.0, 3.0],
            [2.0, 1.0, 2.0, 3.0],
        ]);
        f.samples[1].position_m[0] = 1e200;
        assert_eq!(PopulationPrior::fit([&f]), Err(PriorError::NotFinite));
    }

    #[test]
    fn a_perfect_reading_decides_and_a_useless_one_does_not() {
        let z = expected(&Vector3::new(20.0, 10.0, 9.0), &Vector3::zeros());
        let sharp = Observation::new(z, nalgebra::Vector4::repeat(1e-6));
        let estimate = PRIOR.fused_position(&sharp);
        assert!((estimate.position_m - Vector3::new(20.0, 10.0, 9.0)).norm() < 1e-4);
        let blunt = Observation::new(z, nalgebra::Vector4::new(1e6, 1e-6, 1e6, 1e6));
        let p = PRIOR.fused_position(&blunt).position_m;
        assert!((p.y.atan2(p.x) - z[1]).abs() < 1e-6);
        let flat = PRIOR.range_m.mean * PRIOR.elevation_rad.mean.sin();
        assert!((p.z - flat).abs() < 0.5, "{p}");
    }

    /// Targets drawn from the population itself: NEES of position and velocity must be 3, at the paper's
    /// medium and high noise, and from a vehicle elsewhere, where the belief moves with it and its motion
    /// comes off the range-rate. 4000 draws: a standard error of sqrt(6 / 4000) = 0.04; the Gaussian
    /// stands for a bent region.
    #[test]
    fn beliefs_are_consistent_with_their_population() {
        let mut random = RandomSource::new(7, &[]);
        let rest = (Vector3::zeros(), Vector3::zeros());
        let vehicle = (
            Vector3::new(500.0, -40.0, 3.0),
            Vector3::new(-12.0, 14.0, 1.0),
        );
        let (medium, high) = ([0.01, 0.01, 10.0, 0.1], [0.1, 0.1, 100.0, 1.0]);
        for (sigma, (place, own)) in [(medium, rest), (high, rest), (medium, vehicle)] {
            let sigma = nalgebra::Vector4::from(sigma);
            let mut sums = [0.0; 2];
            let draws = 4000;
            for _ in 0..draws {
                let p = cartesian(
                    PRIOR.elevation_rad.mean + PRIOR.elevation_rad.sigma * random.normal(),
                    random.uniform(-3.0, 3.0),
                    PRIOR.range_m.mean + PRIOR.range_m.sigma * random.normal(),
                );
                let v = Vector3::new(1.7, 1.7, 0.6).map(|s| s * random.normal());
                let z = expected(&p, &(v - own)) + sigma.map(|s| s * random.normal());
                let belief = PRIOR.belief(&Observation {
                    position_m: place,
                    velocity_mps: own,
                    ..Observation::new(z, sigma)
                });
                let errors = [belief.position_m() - p - place, belief.velocity_mps() - v];
                for (half, error) in errors.into_iter().enumerate() {
                    let block = belief.covariance.fixed_view::<3, 3>(3 * half, 3 * half);
                    let nees = error.dot(&block.into_owned().cholesky().unwrap().solve(&error));
                    sums[half] += nees / f64::from(draws);
                }
            }
            let honest = sums.iter().all(|nees| (nees - 3.0).abs() < 0.25);
            assert!(honest, "{own:?} {sums:?}");
        }
    }
}
