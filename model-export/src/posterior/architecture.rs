//! The shape of a network: its widths from input to output.

use bnkf::blob::field::{LAYERS_MAX, WIDTH_MAX};
use serde::{Deserialize, Serialize};

/// Widths of a network from input to output, bounded by what a blob can hold.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<usize>", into = "Vec<usize>")]
pub struct Architecture {
    widths: Vec<usize>,
}

/// Widths that are not a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArchitectureError {
    /// Not one to [`LAYERS_MAX`] layers.
    #[error("{0} layers, but a network has 1 to {LAYERS_MAX}")]
    Layers(usize),
    /// A width that is not 1 to [`WIDTH_MAX`].
    #[error("width {0} is not within 1 to {WIDTH_MAX}")]
    Width(usize),
}

/// One dense layer and where its parameters lie in the flat order of [`Architecture::layers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerShape {
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Index of the first weight; weights are `[output][input]`, biases follow.
    pub start: usize,
}

impl LayerShape {
    /// Index of the first weight of `output`.
    #[must_use]
    pub fn row(&self, output: usize) -> usize {
        self.start + output * self.inputs
    }

    /// Index of the bias of `output`.
    #[must_use]
    pub fn bias(&self, output: usize) -> usize {
        self.start + self.outputs * self.inputs + output
    }

    /// Index after the last bias.
    #[must_use]
    pub fn end(&self) -> usize {
        self.bias(self.outputs)
    }
}

impl Architecture {
    /// A network of `widths` from input to output.
    ///
    /// # Errors
    /// A blob cannot hold it.
    pub fn new(widths: Vec<usize>) -> Result<Self, ArchitectureError> {
        let layers = widths.len().saturating_sub(1);
        if !(1..=LAYERS_MAX).contains(&layers) {
            return Err(ArchitectureError::Layers(layers));
        }
        if let Some(&width) = widths.iter().find(|w| !(1..=WIDTH_MAX).contains(*w)) {
            return Err(ArchitectureError::Width(width));
        }
        Ok(Self { widths })
    }

    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.widths[0]
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.widths[self.widths.len() - 1]
    }

    /// Layers from input to output.
    #[must_use]
    pub fn layers(&self) -> Vec<LayerShape> {
        let mut start = 0;
        self.widths
            .windows(2)
            .map(|pair| {
                let shape = LayerShape {
                    inputs: pair[0],
                    outputs: pair[1],
                    start,
                };
                start = shape.end();
                shape
            })
            .collect()
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.widths
            .windows(2)
            .map(|pair| (pair[0] + 1) * pair[1])
            .sum()
    }
}

impl TryFrom<Vec<usize>> for Architecture {
    type Error = ArchitectureError;

    fn try_from(widths: Vec<usize>) -> Result<Self, Self::Error> {
        Self::new(widths)
    }
}

impl From<Architecture> for Vec<usize> {
    fn from(architecture: Architecture) -> Self {
        architecture.widths
    }
}

impl std::fmt::Display for Architecture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let widths: Vec<String> = self.widths.iter().map(usize::to_string).collect();
        f.write_str(&widths.join("-"))
    }
}

#[cfg(test)]
mod tests {
    use super::{Architecture, ArchitectureError};

    #[test]
    fn the_papers_network_has_17344_weights_and_323_biases() {
        let paper = Architecture::new(vec![12, 64, 64, 64, 64, 64, 3]).unwrap();
        assert_eq!(paper.parameters(), 17_344 + 323);
        let layers = paper.layers();
        assert_eq!(layers[0].end(), layers[1].start);
        assert_eq!(layers[5].end(), paper.parameters());
        assert_eq!(layers[5].row(2) + 64, layers[5].bias(0));
        assert_eq!(paper.to_string(), "12-64-64-64-64-64-3");
    }

    #[test]
    fn what_no_blob_can_hold_is_refused() {
        assert_eq!(
            Architecture::new(vec![12]),
            Err(ArchitectureError::Layers(0))
        );
        assert_eq!(
            Architecture::new(vec![4; 10]),
            Err(ArchitectureError::Layers(9))
        );
        assert_eq!(
            Architecture::new(vec![12, 65, 3]),
            Err(ArchitectureError::Width(65))
        );
        assert_eq!(
            Architecture::new(vec![12, 0, 3]),
            Err(ArchitectureError::Width(0))
        );
        assert!(serde_json::from_str::<Architecture>("[12, 70, 3]").is_err());
    }
}
