//! The int8 grid that a blob's weight means lie on, for the last epochs of training.
//!
//! Rounding a trained network moves its estimates by a part of their predictive standard deviation,
//! since some weights are known far better than their int8 step. So the last epochs compute loss
//! and gradient at rounded means while the unrounded ones keep moving (straight-through gradient):
//! the network learns to live on the grid that it is exported on.

use crate::posterior::architecture::{Architecture, LayerShape};
use bnkf::blob::field::MEAN_CODE_MAX;

/// Largest code.
const CODE_MAX: f32 = MEAN_CODE_MAX as f32;

/// Where the weight means of one output lie in a list of means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Index of the first.
    pub start: usize,
    /// From one to the next.
    pub stride: usize,
    /// How many: the inputs of its layer.
    pub count: usize,
}

impl Channel {
    /// Every output's, in the flat order of [`Architecture::layers`].
    #[must_use]
    pub fn all_of(architecture: &Architecture) -> Vec<Self> {
        let of_layer = |shape: LayerShape| {
            (0..shape.outputs).map(move |output| Self {
                start: shape.row(output),
                stride: 1,
                count: shape.inputs,
            })
        };
        architecture
            .layers()
            .into_iter()
            .flat_map(of_layer)
            .collect()
    }

    fn indices(self) -> impl Iterator<Item = usize> {
        (0..self.count).map(move |input| self.start + input * self.stride)
    }
}

/// One step per output channel, fixed by the means that the grid was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    rows: Vec<Row>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    channel: Channel,
    /// Index of the largest mean. It stays at the end of the scale, which export derives from it.
    largest: usize,
    step: f32,
}

impl Grid {
    /// The grid on which the largest mean of every channel is the largest code.
    #[must_use]
    pub fn of(means: &[f32], channels: impl IntoIterator<Item = Channel>) -> Self {
        let size = |index: &usize| means[*index].abs();
        let row = |channel: Channel| {
            let largest = channel
                .indices()
                .max_by(|a, b| size(a).total_cmp(&size(b)))
                .unwrap_or(channel.start);
            Row {
                channel,
                largest,
                step: means[largest] / CODE_MAX,
            }
        };
        Self {
            rows: channels.into_iter().map(row).collect(),
        }
    }

    /// Puts every weight mean on the grid; biases stay.
    pub fn round(&self, means: &mut [f32]) {
        /// Adding it rounds to an integer.
        const ROUND: f32 = 12_582_912.0;
        for row in self.rows.iter().filter(|row| row.step != 0.0) {
            let inverse = 1.0 / row.step;
            for index in row.channel.indices() {
                let code = (means[index] * inverse).clamp(-CODE_MAX, CODE_MAX);
                means[index] = ((code + ROUND) - ROUND) * row.step;
            }
            means[row.largest] = CODE_MAX * row.step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Channel, Grid};
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
        let grid = Grid::of(&weights.means, Channel::all_of(&architecture));
        // As training would: every mean has moved since.
        for mean in &mut weights.means[13..] {
            *mean += 0.05 * random.normal() as f32;
        }
        let before = weights.clone();
        grid.round(&mut weights.means);
        for error in layer_errors(&weights, &quantise(&weights)) {
            assert!(error.mean_max_steps < 1e-4, "{error:?}");
        }
        for shape in architecture.layers() {
            let biases = shape.bias(0)..shape.end();
            assert_eq!(weights.means[biases.clone()], before.means[biases]);
        }
        let rounded = weights.clone();
        grid.round(&mut weights.means);
        assert_eq!(weights, rounded);
    }
}
