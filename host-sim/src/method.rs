//! The methods under test and their names.

use bnkf::blob::Kind;
use clap::ValueEnum;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::own_name::OwnName;

/// A method of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, ValueEnum)]
pub enum Method {
    /// Extended Kalman filter as the paper set it up: truth start, q = 0.1 m^2/s^3.
    #[value(name = "ekf")]
    Ekf,
    /// Unscented Kalman filter as the paper set it up.
    #[value(name = "ukf")]
    Ukf,
    /// Bayesian neural network, its answer taken as it is.
    #[value(name = "bnn")]
    Bnn,
    /// The same network with the Kalman correction.
    #[value(name = "bnkf")]
    Bnkf,
    /// One network per axis with the Kalman correction.
    #[value(name = "bnkfe")]
    Bnkfe,
    /// BNKF with the network's moments instead of passes.
    #[value(name = "bnkf-moments")]
    BnkfMoments,
    /// BNKFe with the networks' moments instead of passes.
    #[value(name = "bnkfe-moments")]
    BnkfeMoments,
    /// Filter whose motion model a network schedules.
    #[value(name = "recursive")]
    Recursive,
    /// The same with the network's moments instead of mean weights.
    #[value(name = "recursive-moments")]
    RecursiveMoments,
    /// The recursive filter after going on training on the flights that a fold does not test.
    #[value(name = "recursive-tuned")]
    RecursiveTuned,
    /// Extended Kalman filter with a fitted Singer model, started from the first reading.
    #[value(name = "ekf-tuned")]
    EkfTuned,
    /// The same with the unscented correction.
    #[value(name = "ukf-tuned")]
    UkfTuned,
    /// The same with the cubature correction.
    #[value(name = "ckf-tuned")]
    CkfTuned,
    /// Interacting multiple models: constant velocity and four turns, fitted.
    #[value(name = "imm5")]
    Imm5,
    /// A wide bank of ten, not fitted.
    #[value(name = "imm10")]
    Imm10,
    /// Rao-Blackwellised particle filter over the range, with the fitted Singer model.
    #[value(name = "particle")]
    Particle,
    /// The reading converted to Cartesian coordinates.
    #[value(name = "converted")]
    Converted,
    /// The population's mean position.
    #[value(name = "population")]
    PopulationMean,
    /// The reading's direction at the population's mean range.
    #[value(name = "const-range")]
    ConstantRange,
    /// The reading fused with the population's range and elevation.
    #[value(name = "fused")]
    Fused,
    /// One that is not built in: a filter from outside, or estimates from a file.
    #[value(skip)]
    Own(OwnName),
}

impl Method {
    /// The paper's five, in the order of its table.
    pub const PAPER: [Self; 5] = [Self::Ekf, Self::Ukf, Self::Bnn, Self::Bnkf, Self::Bnkfe];

    /// What runs when no methods are named: the paper's and the tracker that the image runs.
    pub const DEFAULT: [Self; 6] = [
        Self::Ekf,
        Self::Ukf,
        Self::Bnn,
        Self::Bnkf,
        Self::Bnkfe,
        Self::Recursive,
    ];

    /// Whether it knows a radar at rest in the origin only.
    pub const fn needs_origin(self) -> bool {
        matches!(
            self,
            Self::Bnn | Self::Bnkf | Self::Bnkfe | Self::BnkfMoments | Self::BnkfeMoments
        )
    }

    /// Kind of the blob that it runs on, and how many networks that holds; filters run on none.
    pub const fn model(self) -> Option<(Kind, usize)> {
        match self {
            Self::Bnn | Self::Bnkf | Self::BnkfMoments => Some((Kind::Memoryless, 1)),
            Self::Bnkfe | Self::BnkfeMoments => Some((Kind::Memoryless, 3)),
            Self::Recursive | Self::RecursiveMoments | Self::RecursiveTuned => {
                Some((Kind::Recursive, 1))
            }
            _ => None,
        }
    }

    /// Whether it asks its networks for their moments, whatever the number of passes.
    pub const fn takes_moments(self) -> bool {
        matches!(
            self,
            Self::BnkfMoments | Self::BnkfeMoments | Self::RecursiveMoments
        )
    }

    /// Whether it needs parameters that are fitted to flights, were it only where flights begin.
    pub const fn is_tuned(self) -> bool {
        match self {
            Self::Ekf
            | Self::Ukf
            | Self::Bnn
            | Self::Bnkf
            | Self::Bnkfe
            | Self::BnkfMoments
            | Self::BnkfeMoments
            | Self::Recursive
            | Self::RecursiveMoments
            | Self::RecursiveTuned
            | Self::Own(_) => false,
            Self::EkfTuned
            | Self::UkfTuned
            | Self::CkfTuned
            | Self::Imm5
            | Self::Imm10
            | Self::Particle
            | Self::Converted
            | Self::PopulationMean
            | Self::ConstantRange
            | Self::Fused => true,
        }
    }

    /// Whether it says of a step that the target is where, or moves as, it was not trained for.
    pub const fn knows_outside(self) -> bool {
        matches!(
            self,
            Self::Recursive | Self::RecursiveMoments | Self::RecursiveTuned
        )
    }

    /// Name in tables, figures and results.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Ekf => "EKF",
            Self::Ukf => "UKF",
            Self::Bnn => "BNN",
            Self::Bnkf => "BNKF",
            Self::Bnkfe => "BNKFe",
            Self::BnkfMoments => "BNKF moments",
            Self::BnkfeMoments => "BNKFe moments",
            Self::Recursive => "recursive",
            Self::RecursiveMoments => "rec. moments",
            Self::RecursiveTuned => "recursive tuned",
            Self::EkfTuned => "EKF tuned",
            Self::UkfTuned => "UKF tuned",
            Self::CkfTuned => "CKF tuned",
            Self::Imm5 => "IMM5",
            Self::Imm10 => "IMM10",
            Self::Particle => "particle",
            Self::Converted => "converted",
            Self::PopulationMean => "population",
            Self::ConstantRange => "const range",
            Self::Fused => "fused",
            Self::Own(name) => name.get(),
        }
    }

    /// One line for people who do not know the name.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Ekf => {
                "extended Kalman filter as the paper set it up: truth start, q = 0.1 m²/s³"
            }
            Self::Ukf => "unscented Kalman filter as the paper set it up",
            Self::Bnn => "Bayesian network alone, Monte Carlo mean and covariance",
            Self::Bnkf => "Bayesian network, then the paper's Kalman correction",
            Self::Bnkfe => "one Bayesian network per axis, then the correction",
            Self::BnkfMoments => "BNKF, mean and covariance of the network without passes",
            Self::BnkfeMoments => "BNKFe, mean and covariance of the networks without passes",
            Self::Recursive => "nine-state Kalman filter, its motion model scheduled by a network",
            Self::RecursiveMoments => {
                "the same, its network's doubt from the moments of all weights"
            }
            Self::RecursiveTuned => {
                "the recursive filter, tuned on the flights that its fold does not test"
            }
            Self::EkfTuned => {
                "extended Kalman filter, fitted Singer model, started from the first reading"
            }
            Self::UkfTuned => "the tuned filter with the unscented correction",
            Self::CkfTuned => "the tuned filter with the cubature correction",
            Self::Imm5 => {
                "interacting multiple models: constant velocity and coordinated turns, fitted"
            }
            Self::Imm10 => "a wide bank of ten motion models, not fitted",
            Self::Particle => {
                "Rao-Blackwellised particle filter: 40 hypotheses of the range, a Kalman filter each"
            }
            Self::Converted => "the reading converted to Cartesian coordinates, nothing else",
            Self::PopulationMean => {
                "the mean position of the flights to tune on, whatever the radar says"
            }
            Self::ConstantRange => {
                "the reading's direction at the mean range of the flights to tune on"
            }
            Self::Fused => {
                "one reading fused with the range and elevation of the flights to tune on"
            }
            Self::Own(_) => "not built in: from outside",
        }
    }
}

impl Serialize for Method {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.label())
    }
}

impl<'de> Deserialize<'de> for Method {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let label = String::deserialize(deserializer)?;
        let built_in = Self::value_variants().iter().copied();
        match built_in.into_iter().find(|method| method.label() == label) {
            Some(method) => Ok(method),
            None => OwnName::new(&label)
                .map(Self::Own)
                .map_err(de::Error::custom),
        }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.label())
    }
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;

    use super::{Method, OwnName};

    #[test]
    fn results_carry_the_label() {
        for method in Method::value_variants() {
            let json = serde_json::to_value(method).unwrap();
            assert_eq!(json, method.label());
            assert_eq!(serde_json::from_value::<Method>(json).unwrap(), *method);
        }
        let own = Method::Own(OwnName::new("mine").unwrap());
        let json = serde_json::to_value(own).unwrap();
        assert_eq!(json, "mine");
        assert_eq!(serde_json::from_value::<Method>(json).unwrap(), own);
        assert!(serde_json::from_value::<Method>("<mine>".into()).is_err());
    }
}
