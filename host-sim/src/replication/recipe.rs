//! What a replica is made by: the paper's text, plus a set of departures from it.

use bnkf_model_export::posterior::architecture::{Architecture, ArchitectureError};
use bnkf_model_export::radar::noise::NoiseTable;

use super::departure::Departure;

/// Hidden neurons a layer: of a network for all outputs, and of one for a single output (BNKFe).
const WIDTH: usize = 64;
const WIDTH_PER_OUTPUT: usize = 32;

/// A set of departures from the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recipe {
    departures: [bool; Departure::ALL.len()],
    /// The divergence is divided by the number of training rows, which makes the loss a bound on
    /// the evidence. Neither the paper nor its code does it.
    pub divergence_per_row: bool,
    /// The prior is N(0, 1), as the paper's Eq. 14 prints it, not the code's N(0, 0.01^2).
    pub unit_prior: bool,
    /// Other initial weights, weight noise and order of rows on the same readings: what a
    /// difference between two recipes has to be compared with.
    pub other_luck: bool,
}

impl Recipe {
    /// The paper's text, its angle figures in degrees.
    pub const PAPER: Self = Self {
        departures: [false; Departure::ALL.len()],
        divergence_per_row: false,
        unit_prior: false,
        other_luck: false,
    };

    /// The published code: every departure.
    pub const REFERENCE_CODE: Self = Self {
        departures: [true; Departure::ALL.len()],
        divergence_per_row: false,
        unit_prior: false,
        other_luck: false,
    };

    /// Whether it departs from the paper there.
    pub fn departs(&self, departure: Departure) -> bool {
        self.departures[departure as usize]
    }

    /// The same with one departure switched.
    #[must_use]
    pub fn switched(mut self, departure: Departure) -> Self {
        self.departures[departure as usize] ^= true;
        self
    }

    /// The same with `departure` taken.
    #[must_use]
    pub fn with(mut self, departure: Departure) -> Self {
        self.departures[departure as usize] = true;
        self
    }

    /// The same with its divergence divided by the number of training rows.
    #[must_use]
    pub fn with_divergence_per_row(mut self) -> Self {
        self.divergence_per_row = true;
        self
    }

    /// The same with the prior N(0, 1).
    #[must_use]
    pub fn with_unit_prior(mut self) -> Self {
        self.unit_prior = true;
        self
    }

    /// The same with other initial weights, weight noise and order of rows.
    #[must_use]
    pub fn with_other_luck(mut self) -> Self {
        self.other_luck = true;
        self
    }

    /// What training depends on: recipes with equal parts share their networks.
    #[must_use]
    pub fn training_part(mut self) -> Self {
        for departure in Departure::ALL {
            self.departures[departure as usize] &= departure.trains();
        }
        self
    }

    /// How the angle figures of the noise table are read.
    pub fn noise_table(&self) -> NoiseTable {
        if self.departs(Departure::Radians) {
            NoiseTable::Radians
        } else {
            NoiseTable::Printed
        }
    }

    /// Number of features.
    pub fn inputs(&self) -> usize {
        if self.departs(Departure::Cartesian) {
            17
        } else {
            12
        }
    }

    /// Number of estimated quantities: the position (m), then perhaps the velocity (m/s).
    pub fn outputs(&self) -> usize {
        if self.departs(Departure::Cartesian) {
            6
        } else {
            3
        }
    }

    /// Shape of one network: for all outputs, or for a single one.
    ///
    /// # Errors
    /// Never for the widths in this file.
    pub fn architecture(&self, per_output: bool) -> Result<Architecture, ArchitectureError> {
        let hidden = if self.departs(Departure::Cartesian) {
            4
        } else {
            5
        };
        let (width, outputs) = if per_output {
            (WIDTH_PER_OUTPUT, 1)
        } else {
            (WIDTH, self.outputs())
        };
        let mut widths = vec![self.inputs()];
        widths.extend(std::iter::repeat_n(width, hidden));
        widths.push(outputs);
        Architecture::new(widths)
    }
}

#[cfg(test)]
mod tests {
    use super::{Departure, Recipe};

    #[test]
    fn the_presets_have_the_stated_shapes() {
        let widths = |recipe: Recipe, per_output| -> Vec<usize> {
            recipe.architecture(per_output).unwrap().into()
        };
        assert_eq!(widths(Recipe::PAPER, false), [12, 64, 64, 64, 64, 64, 3]);
        let reference = Recipe::REFERENCE_CODE;
        assert_eq!(widths(reference, false), [17, 64, 64, 64, 64, 6]);
        assert_eq!(widths(reference, true), [17, 32, 32, 32, 32, 1]);
    }

    #[test]
    fn switching_everything_turns_one_preset_into_the_other() {
        let switched = Departure::ALL
            .into_iter()
            .fold(Recipe::PAPER, Recipe::switched);
        assert_eq!(switched, Recipe::REFERENCE_CODE);
        for departure in Departure::ALL {
            let part = Recipe::PAPER.with(departure).training_part();
            assert_eq!(part != Recipe::PAPER, departure.trains());
        }
    }
}
