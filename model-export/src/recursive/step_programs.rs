//! One step of the filter as the two programs that a window repeats: before the network, after it.

use super::normalisation::Normalisation;
use super::step::{feature_program, filter_program};
use crate::autodiff::program::Program;
use bnkf::recursive::population::Base;

/// The two recorded programs of a step.
#[derive(Clone, Debug)]
pub struct Programs {
    pub(super) features: Program,
    pub(super) filter: Program,
}

impl Programs {
    /// Records both.
    pub fn new(base: &Base<f64>, normalisation: &Normalisation) -> Self {
        Self {
            features: feature_program(normalisation),
            filter: filter_program(base),
        }
    }
}
