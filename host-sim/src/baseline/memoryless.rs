//! Rules that look at one reading and remember nothing but their last answer.
//!
//! What a filter adds is measured against these. In a gap a rule repeats its last answer, and its
//! covariance grows by the square of the way a drone of the population goes in the meantime.

use bnkf::measurement::Channel;
use bnkf_model_export::radar::reading::Reading;
use nalgebra::{Matrix3, Vector3};

use super::ahead::try_forecasts;
use super::clock::Clock;
use super::gaussian::symmetric;
use super::prior::PopulationPrior;
use super::sensor::{Observation, cartesian, cartesian_jacobian};
use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

/// How one reading becomes a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The reading converted to Cartesian coordinates, its covariance likewise.
    Converted,
    /// The population's mean position, whatever the reading says.
    PopulationMean,
    /// The reading's direction at the population's mean range.
    ConstantRange,
    /// The reading fused with the population's range and elevation.
    Fused,
}

impl Rule {
    /// All rules.
    pub const ALL: [Self; 4] = [
        Self::Converted,
        Self::PopulationMean,
        Self::ConstantRange,
        Self::Fused,
    ];

    /// What a reading must have.
    fn needs(self) -> &'static [Channel] {
        match self {
            Self::Converted => &[Channel::Range, Channel::Elevation, Channel::Azimuth],
            Self::PopulationMean => &[],
            Self::ConstantRange => &[Channel::Elevation, Channel::Azimuth],
            Self::Fused => &[Channel::Azimuth],
        }
    }

    /// The answer to one reading, which has what the rule needs.
    pub fn estimate(self, prior: &PopulationPrior, observation: &Observation) -> PositionEstimate {
        let (z, sigma) = (&observation.z, &observation.sigma);
        match self {
            Self::Converted => converted(observation, z[2], &sigma.fixed_rows::<3>(0).into()),
            Self::PopulationMean => PositionEstimate::new(
                prior.position_mean_m.into(),
                prior.position_covariance_m2.into(),
            ),
            Self::ConstantRange => {
                let range = prior.range_m;
                let spherical_sigma = Vector3::new(sigma[0], sigma[1], range.sigma);
                converted(observation, range.mean, &spherical_sigma)
            }
            Self::Fused => prior.fused_position(observation),
        }
    }
}

/// Spherical coordinates with independent errors, carried to Cartesian ones: to first order in
/// the angles, while the lever of their errors is the range's root mean square. With the range as
/// read, a reading that happens to lie near the radar would claim to be exact.
fn converted(observation: &Observation, range_m: f64, sigma: &Vector3<f64>) -> PositionEstimate {
    let (elevation_rad, azimuth_rad) = (observation.z[0], observation.z[1]);
    let lever_m = range_m.hypot(sigma[2]);
    let j = cartesian_jacobian(elevation_rad, azimuth_rad, lever_m);
    let variance = Matrix3::from_diagonal(&sigma.component_mul(sigma));
    PositionEstimate::new(
        cartesian(elevation_rad, azimuth_rad, range_m) + observation.position_m,
        symmetric(&(j * variance * j.transpose())),
    )
}

/// A [`Rule`] as a method under test.
#[derive(Clone, Debug)]
pub struct Memoryless {
    rule: Rule,
    prior: PopulationPrior,
    last: Option<(Clock, PositionEstimate)>,
}

impl Memoryless {
    /// A rule that has not been started.
    pub fn new(rule: Rule, prior: PopulationPrior) -> Self {
        Self {
            rule,
            prior,
            last: None,
        }
    }

    fn answer(&self, reading: &Reading) -> Result<PositionEstimate, FilterError> {
        let observation = Observation::from(reading);
        observation.requires(self.rule.needs())?;
        let estimate = self.rule.estimate(&self.prior, &observation);
        let mut numbers = estimate
            .position_m
            .iter()
            .chain(estimate.covariance_m2.iter());
        if numbers.all(|x| x.is_finite()) {
            Ok(estimate)
        } else {
            Err(FilterError::NotFinite)
        }
    }
}

impl Memoryless {
    /// The last answer `gap_s` later.
    fn aged(&self, last: &PositionEstimate, gap_s: f64) -> PositionEstimate {
        // The population's mean does not age.
        if self.rule == Rule::PopulationMean {
            return *last;
        }
        let (across, up) = (
            self.prior.velocity_horizontal_sigma_mps * gap_s,
            self.prior.velocity_vertical_sigma_mps * gap_s,
        );
        let way_m2 = Vector3::new(across, across, up).map(|way| way * way);
        PositionEstimate {
            covariance_m2: last.covariance_m2 + Matrix3::from_diagonal(&way_m2),
            ..*last
        }
    }
}

impl Filter for Memoryless {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        let estimate = self.answer(start.reading)?;
        self.last = Some((Clock::new(start.reading.time_us), estimate));
        Ok(estimate)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let (clock, last) = self.last.ok_or(FilterError::NotStarted)?;
        let mut now = clock;
        let gap_s = now.advance_s(time_us)?;
        if let Some(reading) = reading {
            let estimate = self.answer(reading)?;
            self.last = Some((now, estimate));
            return Ok(estimate);
        }
        Ok(self.aged(&last, gap_s))
    }

    /// As in a gap.
    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        let (clock, last) = self.last.ok_or(FilterError::NotStarted)?;
        try_forecasts(|horizon| {
            let gap_s = clock.clone().advance_s(times_us[horizon])?;
            Ok(self.aged(&last, gap_s))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::prior::tests::PRIOR;
    use crate::baseline::sensor::expected;
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::random_source::RandomSource;
    use nalgebra::Vector4;

    fn started(rule: Rule) -> Memoryless {
        let reading = Reading {
            time_us: 0,
            range_m: 30.0,
            elevation_rad: 0.3,
            azimuth_rad: 1.0,
            range_rate_mps: 0.0,
            sigma_range_m: 1.0,
            sigma_elevation_rad: 0.01,
            sigma_azimuth_rad: 0.01,
            sigma_range_rate_mps: 0.1,
            sensor: Pose::ORIGIN,
            late_us: 0,
        };
        let (p, v) = (Vector3::zeros(), Vector3::zeros());
        let start = Start {
            reading: &reading,
            true_position_m: p,
            true_velocity_mps: v,
        };
        let mut filter = Memoryless::new(rule, PRIOR);
        assert!(filter.start(&start).is_ok());
        filter
    }

    #[test]
    fn a_gap_repeats_the_answer_and_doubts_it() {
        for rule in Rule::ALL {
            let mut filter = started(rule);
            let first = filter.step(100_000, None).unwrap();
            let later = filter.step(2_000_000, None).unwrap();
            assert_eq!(first.position_m, later.position_m);
            let growth = later.covariance_m2 - first.covariance_m2;
            // (1.7 m/s)^2 (2^2 - 0.1^2) s^2, and nothing for the population's mean.
            let way = if rule == Rule::PopulationMean {
                0.0
            } else {
                1.7 * 1.7 * 3.99
            };
            assert!((growth[(0, 0)] - way).abs() < 1e-9, "{rule:?}");
        }
        assert_eq!(
            Memoryless::new(Rule::Fused, PRIOR).step(0, None),
            Err(FilterError::NotStarted)
        );
    }

    /// A target at 34 m seen many times at the paper's low noise: NEES must be 3. 4000 draws: a
    /// standard error of 0.04.
    #[test]
    fn the_converted_reading_is_consistent() {
        let mut random = RandomSource::new(11, &[]);
        let truth = Vector3::new(-25.0, 15.0, 17.0);
        let sigma = Vector4::new(0.001, 0.001, 1.0, 0.01);
        let mut nees = 0.0;
        for _ in 0..4000 {
            let z = expected(&truth, &Vector3::zeros()) + sigma.map(|s| s * random.normal());
            let estimate = Rule::Converted.estimate(&PRIOR, &Observation::new(z, sigma));
            let error = estimate.position_m - truth;
            nees += error.dot(&estimate.covariance_m2.cholesky().unwrap().solve(&error)) / 4000.0;
        }
        assert!((nees - 3.0).abs() < 0.2, "{nees}");
    }

    #[test]
    fn constant_range_takes_the_direction_only() {
        let filter = started(Rule::ConstantRange);
        let (_, estimate) = filter.last.unwrap();
        let direction = cartesian(0.3, 1.0, 1.0);
        assert!((estimate.position_m - direction * 34.0).norm() < 1e-12);
        let radial = direction.dot(&(estimate.covariance_m2 * direction));
        assert!((radial - 36.0).abs() < 1e-9);
    }
}
