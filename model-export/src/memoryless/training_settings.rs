//! What a training run is asked to do.

use crate::brief_number::brief;
use crate::posterior::architecture::{Architecture, ArchitectureError};
use crate::radar::noise::NoiseTable;
use bnkf::blob::FeatureLayout;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Most epochs.
pub const EPOCHS_MAX: u32 = 1_000_000;

/// Features of the memoryless network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Features {
    /// The paper's twelve.
    #[value(name = "polar12")]
    Polar12,
    /// Azimuth without a jump, logarithms of the sigmas, and the time between the measurements.
    #[value(name = "polar13")]
    Polar13,
}

impl Features {
    /// The layout in the blob.
    #[must_use]
    pub fn layout(self) -> FeatureLayout {
        match self {
            Self::Polar12 => FeatureLayout::Polar12,
            Self::Polar13 => FeatureLayout::Polar13,
        }
    }
}

/// What squared errors are measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ErrorScale {
    /// Half the squared error over the variance that a memoryless estimate can reach with the
    /// row's noise, summed over the axes: nats, a Gaussian likelihood. Every noise level counts.
    Whitened,
    /// Mean squared error over the axes, m^2, as in the paper: high noise outweighs the rest.
    Metres,
}

/// How the divergence from the prior enters the loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Divergence {
    /// Divided by the number of training positions.
    PerRow,
    /// As the paper prints it: MSE + KL.
    Paper,
}

/// Everything that decides the result besides the flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingSettings {
    /// Features of the network.
    pub features: Features,
    /// Three networks, one per axis (BNKFe), instead of one.
    pub ensemble: bool,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Unit of the noise levels' angle figures.
    pub noise_table: NoiseTable,
    /// What squared errors are measured in.
    pub error_scale: ErrorScale,
    /// How the divergence from the prior enters the loss.
    pub divergence: Divergence,
    /// Factor on the divergence.
    pub kl_weight: f64,
    /// Standard deviation of the prior of every weight.
    pub prior_sigma: f64,
    /// Initial standard deviation of every weight.
    pub initial_sigma: f64,
    /// Epochs: passes over every flight at every noise level and sampling rate.
    pub epochs: u32,
    /// Training stops after this many epochs without a better held-out loss.
    pub patience: u32,
    /// Rows of a minibatch.
    pub batch: usize,
    /// Learning rate at the start; it falls to zero along half a cosine.
    pub rate: f64,
    /// Epochs after these with the weight means on the int8 grid (see [`crate::blob::grid`]).
    pub grid_epochs: u32,
    /// Learning rate at their start.
    pub grid_rate: f64,
    /// Part of the recordings that is held out.
    pub held_out: f64,
    /// Seed of everything random.
    pub seed: u64,
}

/// A setting that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrainingSettingsError {
    /// The layers are not a network.
    #[error("--hidden: {0}")]
    Hidden(#[from] ArchitectureError),
    /// A number is NaN or outside its bounds.
    #[error("--{option} {} is not above {above} and at most {most}", brief(*value))]
    OutOfRange {
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Must be above this.
        above: f64,
        /// Must be at most this.
        most: f64,
    },
}

impl Default for TrainingSettings {
    /// The shipped BNKF model's.
    fn default() -> Self {
        Self {
            features: Features::Polar13,
            ensemble: false,
            hidden: vec![64; 5],
            noise_table: NoiseTable::Radians,
            error_scale: ErrorScale::Whitened,
            divergence: Divergence::PerRow,
            kl_weight: 1.0,
            prior_sigma: 0.3,
            initial_sigma: 0.01,
            epochs: 200,
            patience: 30,
            batch: 512,
            rate: 2e-3,
            grid_epochs: 10,
            grid_rate: 2e-4,
            held_out: 0.1,
            seed: 1,
        }
    }
}

impl TrainingSettings {
    /// Number of networks.
    #[must_use]
    pub fn networks(&self) -> usize {
        if self.ensemble { 3 } else { 1 }
    }

    /// Shape of each network.
    ///
    /// # Errors
    /// The hidden widths are not a network that a blob can hold.
    pub fn architecture(&self) -> Result<Architecture, ArchitectureError> {
        let mut widths = vec![self.features.layout().len()];
        widths.extend(&self.hidden);
        widths.push(3 / self.networks());
        Architecture::new(widths)
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// The first one that makes no sense.
    pub fn check(&self) -> Result<(), TrainingSettingsError> {
        self.architecture()?;
        for (option, value, above, most) in [
            ("kl-weight", self.kl_weight, 0.0, 1e9),
            ("prior-sigma", self.prior_sigma, 0.0, 1e3),
            ("initial-sigma", self.initial_sigma, 0.0, 10.0),
            ("epochs", f64::from(self.epochs), 0.0, f64::from(EPOCHS_MAX)),
            ("patience", f64::from(self.patience), 0.0, 1e6),
            ("batch", self.batch as f64, 0.0, 1e6),
            ("rate", self.rate, 0.0, 1.0),
            ("grid-rate", self.grid_rate, 0.0, 1.0),
            ("held-out", self.held_out, 0.0, 0.9),
            // None at all is a choice, which the others are not.
            ("grid-epochs", f64::from(self.grid_epochs), -1.0, 1e6),
        ] {
            if !(value > above && value <= most) {
                return Err(TrainingSettingsError::OutOfRange {
                    option,
                    value,
                    above,
                    most,
                });
            }
        }
        Ok(())
    }
}
