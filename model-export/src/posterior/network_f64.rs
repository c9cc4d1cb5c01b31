//! The network again, naive and in f64: what the fast kernels, the quantised blob and the
//! firmware's inference are compared with.

use bnkf::blob::Activation;

use crate::posterior::gaussian_weights::GaussianWeights;

/// One dense layer with Gaussian weights.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerF64 {
    /// Weight means, `[output][input]`.
    pub means: Vec<Vec<f64>>,
    /// Weight variances, `[output][input]`.
    pub variances: Vec<Vec<f64>>,
    /// Bias means.
    pub bias_means: Vec<f64>,
    /// Bias variances.
    pub bias_variances: Vec<f64>,
}

/// Dense layers with an activation between them. Inputs and outputs are in normalised units.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkF64 {
    /// Layers from input to output.
    pub layers: Vec<LayerF64>,
    /// What every layer but the last ends in.
    pub activation: Activation,
}

impl From<&GaussianWeights> for NetworkF64 {
    fn from(weights: &GaussianWeights) -> Self {
        let mean = |i: usize| f64::from(weights.means[i]);
        let variance = |i: usize| (2.0 * f64::from(weights.log_sigmas[i])).exp();
        let layers = weights.architecture.layers().into_iter().map(|shape| {
            let rows = |f: &dyn Fn(usize) -> f64| -> Vec<Vec<f64>> {
                let row = |o| (shape.row(o)..shape.row(o) + shape.inputs).map(f).collect();
                (0..shape.outputs).map(row).collect()
            };
            let biases = shape.bias(0)..shape.end();
            LayerF64 {
                means: rows(&mean),
                variances: rows(&variance),
                bias_means: biases.clone().map(mean).collect(),
                bias_variances: biases.map(variance).collect(),
            }
        });
        Self {
            layers: layers.collect(),
            activation: Activation::Gelu,
        }
    }
}

impl NetworkF64 {
    /// Every weight at its mean.
    #[must_use]
    pub fn mean_pass(&self, inputs: &[f64]) -> Vec<f64> {
        self.sampled_pass(inputs, || 0.0)
    }

    /// One pass with sampled pre-activations (local reparameterisation). `noise` gives standard
    /// normal numbers, asked for layer by layer, output by output.
    #[must_use]
    pub fn sampled_pass(&self, inputs: &[f64], mut noise: impl FnMut() -> f64) -> Vec<f64> {
        self.pass(inputs, |layer, x, output| {
            let (mut mean, mut variance) = (layer.bias_means[output], layer.bias_variances[output]);
            for (input, x) in x.iter().enumerate() {
                mean += layer.means[output][input] * x;
                variance += layer.variances[output][input] * x * x;
            }
            mean + variance.sqrt() * noise()
        })
    }

    /// One pass with every weight and bias sampled: the definition of the network.
    #[must_use]
    pub fn weight_sampled_pass(&self, inputs: &[f64], mut noise: impl FnMut() -> f64) -> Vec<f64> {
        self.pass(inputs, |layer, x, output| {
            let mut sum = layer.bias_means[output] + layer.bias_variances[output].sqrt() * noise();
            for (input, x) in x.iter().enumerate() {
                let sigma = layer.variances[output][input].sqrt();
                sum += (layer.means[output][input] + sigma * noise()) * x;
            }
            sum
        })
    }

    fn pass(
        &self,
        inputs: &[f64],
        mut neuron: impl FnMut(&LayerF64, &[f64], usize) -> f64,
    ) -> Vec<f64> {
        let mut x = inputs.to_vec();
        for (index, layer) in self.layers.iter().enumerate() {
            x = (0..layer.bias_means.len())
                .map(|output| neuron(layer, &x, output))
                .collect();
            if index + 1 < self.layers.len() {
                x = x
                    .into_iter()
                    .map(|x| activate(self.activation, x))
                    .collect();
            }
        }
        x
    }
}

fn activate(activation: Activation, x: f64) -> f64 {
    match activation {
        Activation::Gelu => gelu(x),
        Activation::Relu => x.max(0.0),
        Activation::Tanh => libm::tanh(x),
        Activation::Identity => x,
    }
}

/// `x * Phi(x)`.
#[must_use]
pub fn gelu(x: f64) -> f64 {
    0.5 * x * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}
