//! The methods under test and their names.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// A method of the table.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, ValueEnum, Serialize, Deserialize,
)]
pub enum Method {
    /// Extended Kalman filter as the paper set it up.
    #[serde(rename = "EKF")]
    #[value(name = "ekf")]
    Ekf,
    /// Unscented Kalman filter as the paper set it up.
    #[serde(rename = "UKF")]
    #[value(name = "ukf")]
    Ukf,
    /// Bayesian neural network, its answer taken as it is.
    #[serde(rename = "BNN")]
    #[value(name = "bnn")]
    Bnn,
    /// The same network with the Kalman correction.
    #[serde(rename = "BNKF")]
    #[value(name = "bnkf")]
    Bnkf,
    /// One network per axis with the Kalman correction.
    #[serde(rename = "BNKFe")]
    #[value(name = "bnkfe")]
    Bnkfe,
}

impl Method {
    /// The paper's five, in the order of its table.
    pub const PAPER: [Self; 5] = [Self::Ekf, Self::Ukf, Self::Bnn, Self::Bnkf, Self::Bnkfe];

    /// Name in tables, figures and results.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Ekf => "EKF",
            Self::Ukf => "UKF",
            Self::Bnn => "BNN",
            Self::Bnkf => "BNKF",
            Self::Bnkfe => "BNKFe",
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
    use super::Method;

    #[test]
    fn results_carry_the_label() {
        for method in Method::PAPER {
            let json = serde_json::to_value(method).unwrap();
            assert_eq!(json, method.label());
        }
    }
}
