//! One step of the filter as the two programs that a window repeats: before the network, after it.

use super::normalisation::Normalisation;
use super::step::{Weighing, feature_program, filter_program};
use crate::autodiff::program::Program;
use bnkf::recursive::parameters::Parameters;

/// The two recorded programs of a step.
#[derive(Clone, Debug)]
pub struct Programs {
    pub(super) features: Program,
    pub(super) filter: Program,
}

impl Programs {
    /// Records both.
    pub fn new(
        parameters: &Parameters<f64>,
        normalisation: &Normalisation,
        weighing: Weighing,
    ) -> Self {
        Self {
            features: feature_program(normalisation),
            filter: filter_program(parameters, weighing),
        }
    }
}
