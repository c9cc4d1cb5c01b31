//! The affine maps between physical units and what the networks compute with.

use bnkf_model_export::memoryless::rows::Rows;

/// Mean and scale of every feature and output of the training rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaling {
    /// Mean and standard deviation of each feature, in its unit; a constant one keeps the scale 1.
    inputs: Vec<(f64, f64)>,
    /// Mean of each output, in its unit.
    output_means: Vec<f64>,
    /// One scale for all outputs: squared errors in metres and in m/s keep their relative weight.
    output_scale: f64,
}

impl Scaling {
    /// Moments of the training rows; outputs are scaled by the spread of the position.
    ///
    /// # Panics
    /// If there are no rows.
    pub fn of(features: &[Vec<f64>], targets: &[Vec<f64>]) -> Self {
        let inputs = (0..features[0].len()).map(|i| {
            let (mean, sigma) = moments(features, i);
            // Sums of equal values err by a rounding or two.
            let varies = sigma > 1e-9 * mean.abs().max(1e-6);
            (mean, if varies { sigma } else { 1.0 })
        });
        let outputs: Vec<(f64, f64)> = (0..targets[0].len()).map(|o| moments(targets, o)).collect();
        let variance = outputs[..3]
            .iter()
            .map(|(_, sigma)| sigma * sigma)
            .sum::<f64>()
            / 3.0;
        Self {
            inputs: inputs.collect(),
            output_means: outputs.iter().map(|(mean, _)| *mean).collect(),
            output_scale: if variance > 0.0 { variance.sqrt() } else { 1.0 },
        }
    }

    /// Normalised rows. The loss of a row is its squared error, averaged over the outputs of one
    /// network, in m^2 (and m^2/s^2).
    pub fn rows(&self, features: &[Vec<f64>], targets: &[Vec<f64>], per_output: bool) -> Rows {
        let outputs = self.output_means.len();
        let mut rows = Rows::new(self.inputs.len(), outputs);
        let averaged = if per_output { 1.0 } else { outputs as f64 };
        let weight = (self.output_scale * self.output_scale / averaged) as f32;
        for (features, targets) in features.iter().zip(targets) {
            let scaled = features.iter().zip(&self.inputs);
            rows.features
                .extend(scaled.map(|(x, (mean, scale))| ((x - mean) / scale) as f32));
            let scaled = targets.iter().zip(&self.output_means);
            rows.targets
                .extend(scaled.map(|(y, mean)| ((y - mean) / self.output_scale) as f32));
            rows.weights.push(weight);
        }
        rows
    }

    /// An output of the network, in its unit.
    pub fn physical(&self, output: usize, value: f32) -> f64 {
        self.output_means[output] + self.output_scale * f64::from(value)
    }
}

/// Mean and standard deviation of column `column`.
fn moments(rows: &[Vec<f64>], column: usize) -> (f64, f64) {
    let n = rows.len() as f64;
    let mean = rows.iter().map(|row| row[column]).sum::<f64>() / n;
    let variance = rows
        .iter()
        .map(|row| (row[column] - mean).powi(2))
        .sum::<f64>()
        / n;
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::Scaling;

    #[test]
    fn rows_are_centred_and_lead_back() {
        let features: Vec<Vec<f64>> = (-2..=2).map(|i| vec![f64::from(i), 0.1]).collect();
        let targets: Vec<Vec<f64>> = (-2..=2)
            .map(|i| vec![3.0 * f64::from(i) + 1.0, 0.0, 5.0, 0.5 * f64::from(i)])
            .collect();
        let scaling = Scaling::of(&features, &targets);
        let rows = scaling.rows(&features, &targets, false);
        assert!((rows.features_of(4)[0] - 2.0_f32.sqrt()).abs() < 1e-6);
        assert!(rows.features_of(4)[1].abs() < 1e-6);
        // Position variance 18 on x alone, averaged over three axes.
        let scale = 6.0_f64.sqrt();
        assert!((f64::from(rows.targets_of(4)[0]) - 6.0 / scale).abs() < 1e-6);
        assert!((rows.weights[0] - 6.0 / 4.0).abs() < 1e-6);
        assert_eq!(scaling.rows(&features, &targets, true).weights[0], 6.0);
        for output in 0..4 {
            let back = scaling.physical(output, rows.targets_of(4)[output]);
            assert!((back - targets[4][output]).abs() < 1e-6);
        }
    }
}
