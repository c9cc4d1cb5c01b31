//! Where a filter begins: at the truth, as the paper's do, or at the first reading.

use bnkf::measurement::Channel;
use bnkf_model_export::radar::reading::Reading;
use nalgebra::{Matrix6, Vector6};

use super::gaussian::Gaussian;
use super::prior::PopulationPrior;
use super::sensor::Observation;
use crate::filter::{FilterError, Start};

/// How the belief at the first sample is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// The paper's: at the truth, with P0 = diag(sigma_range^2 x 3, sigma_range_rate^2 x 3).
    /// No filter in the field has this.
    Truth,
    /// At the first reading, fused with what is known of the population.
    Population(PopulationPrior),
}

impl Origin {
    /// What a filter that began here makes of a reading: the paper's take the angles as they come,
    /// those for the field mind the zenith.
    pub fn observation(&self, reading: &Reading) -> Observation {
        let observation = Observation::from(reading);
        match self {
            Self::Truth => observation,
            Self::Population(_) => observation.clear_of_the_zenith(),
        }
    }

    /// Belief about position and velocity at the first sample.
    ///
    /// # Errors
    /// [`FilterError::Missing`]: the paper's need range and range-rate, the others an azimuth.
    pub fn belief(&self, start: &Start<'_>) -> Result<Gaussian<6>, FilterError> {
        let observation = Observation::from(start.reading);
        match self {
            Self::Truth => {
                observation.requires(&[Channel::Range, Channel::RangeRate])?;
                Ok(truth(start))
            }
            Self::Population(prior) => {
                observation.requires(&[Channel::Azimuth])?;
                Ok(prior.belief(&observation))
            }
        }
    }
}

fn truth(start: &Start<'_>) -> Gaussian<6> {
    let (p, v) = (start.true_position_m, start.true_velocity_mps);
    let mut variance = Vector6::repeat(start.reading.sigma_range_m.powi(2));
    variance
        .fixed_rows_mut::<3>(3)
        .fill(start.reading.sigma_range_rate_mps.powi(2));
    Gaussian {
        mean: Vector6::new(p.x, p.y, p.z, v.x, v.y, v.z),
        covariance: Matrix6::from_diagonal(&variance),
    }
}
