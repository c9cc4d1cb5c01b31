//! Offset and gain of the features.

use bnkf::recursive::features::{FEATURE_LIMIT, FEATURES};
use bnkf::scalar::Scalar;

/// Offset and gain that bring every feature to zero mean and unit deviation.
#[derive(Clone, Debug, PartialEq)]
pub struct Normalisation {
    /// Subtracted first.
    pub offset: [f64; FEATURES],
    /// Multiplied after.
    pub gain: [f64; FEATURES],
}

impl Normalisation {
    /// Leaves the features as they are, within [`FEATURE_LIMIT`].
    pub const IDENTITY: Self = Self {
        offset: [0.0; FEATURES],
        gain: [1.0; FEATURES],
    };

    /// `(feature - offset) * gain`, within [`FEATURE_LIMIT`].
    pub fn apply<S: Scalar>(&self, features: &[S; FEATURES]) -> [S; FEATURES] {
        core::array::from_fn(|i| {
            let centred = features[i] - S::constant(self.offset[i]);
            (centred * S::constant(self.gain[i])).clamp(-FEATURE_LIMIT, FEATURE_LIMIT)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalised_features_are_bounded() {
        let mut normalisation = Normalisation::IDENTITY;
        normalisation.offset[1] = 2.0;
        normalisation.gain[1] = 0.5;
        let mut features = [0.0; FEATURES];
        (features[0], features[1], features[2]) = (1e6, 3.0, -1e6);
        let bounded = normalisation.apply(&features);
        assert_eq!(bounded[..4], [FEATURE_LIMIT, 0.5, -FEATURE_LIMIT, 0.0]);
    }
}
