//! The int8 grid that a blob's weight means lie on, for the last epochs of training.
//!
//! Rounding a trained network moves its estimates by a part of their predictive standard deviation,
//! since some weights are known far better than their int8 step. So the last epochs compute loss
//! and gradient at rounded means while the unrounded ones keep moving (straight-through gradient):
//! the network learns to live on the grid that it is exported on.

use crate::posterior::gaussian_weights::GaussianWeights;
use bnkf::blob::field::MEAN_CODE_MAX;

/// Largest code.
const CODE_MAX: f32 = MEAN_CODE_MAX as f32;

/// One step per output channel, fixed by the weights that the grid was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    rows: Vec<Row>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    start: usize,
    end: usize,
    /// Index of the largest mean. It stays at the end of the scale, which export derives from it.
    largest: usize,
    step: f32,
}

impl Grid {
    /// The grid on which the largest mean of every channel is the largest code.
    #[must_use]
    pub fn of(weights: &GaussianWeights) -> Self {
        let mut rows = Vec::new();
        for shape in weights.architecture.layers() {
            for output in 0..shape.outputs {
                let (start, end) = (shape.row(output), shape.row(output) + shape.inputs);
                let size = |index: &usize| weights.means[*index].abs();
                let largest = (start..end).max_by(|a, b| size(a).total_cmp(&size(b)));
                let largest = largest.unwrap_or(start);
                rows.push(Row {
                    start,
                    end,
                    largest,
                    step: weights.means[largest] / CODE_MAX,
                });
            }
        }
        Self { rows }
    }

    /// Puts every weight mean on the grid; biases stay.
    pub fn round(&self, weights: &mut GaussianWeights) {
        /// Adding it rounds to an integer.
        const ROUND: f32 = 12_582_912.0;
        for row in self.rows.iter().filter(|row| row.step != 0.0) {
            let inverse = 1.0 / row.step;
            for mean in &mut weights.means[row.start..row.end] {
                let code = (*mean * inverse).clamp(-CODE_MAX, CODE_MAX);
                *mean = ((code + ROUND) - ROUND) * row.step;
            }
            weights.means[row.largest] = CODE_MAX * row.step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Grid;
    use crate::blob::quantise::{layer_errors, quantise};
    use crate::posterior::architecture::Architecture;
    use crate::posterior::gaussian_weights::GaussianWeights;
    use crate::random_source::RandomSource;

    #[test]
    fn export_does_not_move_what_lies_on_the_grid() {
        let architecture = Architecture::new(vec![13, 20, 3]).unwrap();
        let mut random = RandomSource::new(8, &[]);
        let mut weights = GaussianWeights::random(&architecture, 0.01, &mut random);
        weights.means[..13].fill(0.0);
        let grid = Grid::of(&weights);
        // As training would: every mean has moved since.
        for mean in &mut weights.means[13..] {
            *mean += 0.05 * random.normal() as f32;
        }
        let before = weights.clone();
        grid.round(&mut weights);
        for error in layer_errors(&weights, &quantise(&weights)) {
            assert!(error.mean_max_steps < 1e-4, "{error:?}");
        }
        for shape in architecture.layers() {
            let biases = shape.bias(0)..shape.end();
            assert_eq!(weights.means[biases.clone()], before.means[biases]);
        }
        let rounded = weights.clone();
        grid.round(&mut weights);
        assert_eq!(weights, rounded);
    }
}
