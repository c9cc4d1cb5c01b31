//! The unscented transform of a belief through the radar's measurement function.
//!
//! Angles are averaged on the circle (the direction of the weighted mean of sines and cosines)
//! and their differences wrapped, so a belief that straddles azimuth +-pi is met correctly.

use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

use super::correction::Expectation;
use super::gaussian::{Gaussian, symmetric};
use super::sensor::{self, Observation};
use crate::filter::FilterError;

/// Scaling of the 2N + 1 points (Julier and Uhlmann; Wan and van der Merwe).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Distance of the points from the mean, no unit.
    pub alpha: f64,
    /// Extra weight of the central point in covariances; 2 is best for a Gaussian.
    pub beta: f64,
    /// Second scaling, no unit.
    pub kappa: f64,
}

impl Spread {
    /// The UKF's: no negative weight, so every covariance it makes is positive semi-definite.
    ///
    /// The customary `alpha` = 1e-3 gives weights of about +-1e6 here. Their differences lose
    /// six digits, the covariance loses definiteness, and the run ends in NaN within a few dozen
    /// steps at medium noise: the paper's UKF did.
    pub const UNIT: Self = Self {
        alpha: 1.0,
        beta: 2.0,
        kappa: 0.0,
    };

    /// The cubature Kalman filter's rule: the central point has no weight at all.
    pub const CUBATURE: Self = Self {
        alpha: 1.0,
        beta: 0.0,
        kappa: 0.0,
    };

    /// Predicts the reading.
    pub(super) fn expectation<const N: usize>(
        &self,
        belief: &Gaussian<N>,
        observation: &Observation,
    ) -> Result<Expectation<N>, FilterError> {
        let scale = self.alpha * self.alpha * (N as f64 + self.kappa);
        let outer = 0.5 / scale;
        let centre = 1.0 - N as f64 / scale;
        let centre_covariance = centre + 1.0 - self.alpha * self.alpha + self.beta;
        let factor = belief
            .covariance
            .cholesky()
            .ok_or(FilterError::NotPositiveDefinite)?;
        let offsets: SMatrix<f64, N, N> = factor.unpack() * scale.sqrt();

        let reading = |x: &SVector<f64, N>| {
            let (p, v) = (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into());
            observation.expected(&p, &v)
        };
        let z0 = reading(&belief.mean);
        let plus: [Vector4<f64>; N] =
            core::array::from_fn(|i| reading(&(belief.mean + offsets.column(i))));
        let minus: [Vector4<f64>; N] =
            core::array::from_fn(|i| reading(&(belief.mean - offsets.column(i))));

        let mut mean = CircularMean::default();
        mean.add(&z0, centre);
        for z in plus.iter().chain(&minus) {
            mean.add(z, outer);
        }
        let mean = mean.value();

        let d0 = sensor::residual(&z0, &mean);
        let mut covariance: Matrix4<f64> =
            d0 * d0.transpose() * centre_covariance + observation.noise();
        let mut cross = SMatrix::<f64, N, 4>::zeros();
        for i in 0..N {
            let up = sensor::residual(&plus[i], &mean);
            let down = sensor::residual(&minus[i], &mean);
            covariance += (up * up.transpose() + down * down.transpose()) * outer;
            cross += offsets.column(i) * (up - down).transpose() * outer;
        }
        Ok(Expectation {
            residual: sensor::residual(&observation.z, &mean),
            covariance: symmetric(&covariance),
            cross,
        })
    }
}

/// Weighted mean of reading vectors.
#[derive(Default)]
struct CircularMean {
    /// Weighted sines and cosines of elevation and azimuth.
    sines: [f64; 2],
    cosines: [f64; 2],
    range_m: f64,
    range_rate_mps: f64,
}

impl CircularMean {
    fn add(&mut self, z: &Vector4<f64>, weight: f64) {
        for angle in 0..2 {
            self.sines[angle] += weight * z[angle].sin();
            self.cosines[angle] += weight * z[angle].cos();
        }
        self.range_m += weight * z[2];
        self.range_rate_mps += weight * z[3];
    }

    fn value(&self) -> Vector4<f64> {
        Vector4::new(
            self.sines[0].atan2(self.cosines[0]),
            self.sines[1].atan2(self.cosines[1]),
            self.range_m,
            self.range_rate_mps,
        )
    }
}
