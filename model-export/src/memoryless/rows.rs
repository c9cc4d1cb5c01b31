//! Training examples as the network sees them.

/// Examples in normalised units, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Features of a row.
    pub inputs: usize,
    /// Targets of a row.
    pub outputs: usize,
    /// `rows` x `inputs`, normalised.
    pub features: Vec<f32>,
    /// `rows` x `outputs`, normalised.
    pub targets: Vec<f32>,
    /// Factor of each row's summed squared error in the loss.
    pub weights: Vec<f32>,
}

impl Rows {
    /// No rows yet.
    #[must_use]
    pub fn new(inputs: usize, outputs: usize) -> Self {
        Self {
            inputs,
            outputs,
            features: Vec::new(),
            targets: Vec::new(),
            weights: Vec::new(),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// Features of row `row`.
    #[must_use]
    pub fn features_of(&self, row: usize) -> &[f32] {
        &self.features[row * self.inputs..][..self.inputs]
    }

    /// Targets of row `row`.
    #[must_use]
    pub fn targets_of(&self, row: usize) -> &[f32] {
        &self.targets[row * self.outputs..][..self.outputs]
    }
}
