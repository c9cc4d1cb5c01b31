//! Blobs for the tests of this crate, written field by field so that every field can be made wrong.

use super::{Activation, Kind, checksum, field};
use crate::gaussian::standard_normal;
use crate::rng::{Generator, seeded};
use rand_core::Rng;
use std::vec::Vec;

/// One layer as the format codes it; rows are not padded.
#[derive(Clone, Debug)]
pub struct DraftLayer {
    pub inputs: usize,
    pub outputs: usize,
    /// `[output][input]`.
    pub means: Vec<i8>,
    /// `[output][input]`.
    pub variance_codes: Vec<u8>,
    pub channel_scale: Vec<f32>,
    pub bias_mean: Vec<f32>,
    pub bias_variance: Vec<f32>,
    pub variance_max: f32,
    /// Weights that stand in for the means by definition, where a test drew its own.
    pub drawn: Option<Vec<f64>>,
}

impl DraftLayer {
    /// Random numbers of ordinary sizes.
    pub fn random(inputs: usize, outputs: usize, rng: &mut Generator) -> Self {
        let weights = inputs * outputs;
        let code = |rng: &mut Generator| 200 + (rng.next_u32() % 56) as u8;
        Self {
            inputs,
            outputs,
            means: (0..weights).map(|_| rng.next_u32() as i8).collect(),
            variance_codes: (0..weights).map(|_| code(rng)).collect(),
            channel_scale: (0..outputs).map(|row| 0.003 + 0.001 * row as f32).collect(),
            bias_mean: (0..outputs).map(|_| standard_normal(rng)).collect(),
            bias_variance: (0..outputs).map(|row| 0.01 * (1 + row) as f32).collect(),
            variance_max: 0.05,
            drawn: None,
        }
    }

    /// Mean of a weight, by definition.
    pub fn mean(&self, output: usize, input: usize) -> f64 {
        let at = output * self.inputs + input;
        match &self.drawn {
            Some(weights) => weights[at],
            None => f64::from(self.means[at]) * f64::from(self.channel_scale[output]),
        }
    }

    /// Variance of a weight, by definition.
    pub fn variance(&self, output: usize, input: usize) -> f64 {
        match self.variance_codes[output * self.inputs + input] {
            0 => 0.0,
            code => f64::from(self.variance_max) * libm::exp2((f64::from(code) - 255.0) / 8.0),
        }
    }

    fn data(&self) -> Vec<u8> {
        let padding = field::row_stride(self.inputs) - self.inputs;
        let padded = |row: &[u8]| [row, &[0; 3][..padding]].concat();
        let means: Vec<u8> = self.means.iter().map(|&code| code as u8).collect();
        let rows = means
            .chunks(self.inputs)
            .chain(self.variance_codes.chunks(self.inputs));
        let mut bytes: Vec<u8> = rows.flat_map(padded).collect();
        for floats in [&self.channel_scale, &self.bias_mean, &self.bias_variance] {
            bytes.extend(floats.iter().flat_map(|value| value.to_le_bytes()));
        }
        bytes
    }
}

/// A blob before its bytes.
#[derive(Clone, Debug)]
pub struct Draft {
    pub kind: u8,
    pub features: u8,
    pub activation: Activation,
    pub passes: u16,
    pub parameters: Vec<f32>,
    /// Mean and inverse scale of each input.
    pub inputs: Vec<[f32; 2]>,
    /// Mean and scale of each output of each network.
    pub outputs: Vec<[f32; 2]>,
    pub networks: Vec<Vec<DraftLayer>>,
}

impl Draft {
    /// A memoryless model with one network of the given widths, 12 inputs first.
    pub fn memoryless(widths: &[usize], seed: u64) -> Self {
        let mut rng = seeded(seed);
        let outputs = widths[widths.len() - 1];
        Self {
            kind: 1,
            features: 1,
            activation: Activation::Gelu,
            passes: 100,
            parameters: std::vec![1.5, 2.5],
            inputs: (0..widths[0]).map(|i| [i as f32 - 6.0, 0.5]).collect(),
            outputs: (0..outputs).map(|i| [10.0 * i as f32, 20.0]).collect(),
            networks: std::vec![layers(widths, &mut rng)],
        }
    }

    /// Three memoryless networks of one output each.
    pub fn ensemble(seed: u64) -> Self {
        let mut rng = seeded(seed);
        Self {
            outputs: std::vec![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]],
            networks: (0..3).map(|_| layers(&[12, 5, 1], &mut rng)).collect(),
            ..Self::memoryless(&[12, 3], seed)
        }
    }

    /// A recursive model.
    pub fn recursive(seed: u64) -> Self {
        let mut rng = seeded(seed);
        Self {
            kind: 2,
            features: 3,
            activation: Activation::Gelu,
            passes: 1,
            parameters: crate::recursive::parameters::Parameters::PAPER
                .list()
                .to_vec(),
            inputs: std::vec![[0.0, 1.0]; 64],
            outputs: std::vec![[0.0, 1.0]; field::RECURSIVE_OUTPUTS],
            networks: std::vec![layers(&[64, 10, field::RECURSIVE_OUTPUTS], &mut rng)],
        }
    }

    /// The whole blob, checksum and all.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = std::vec![0; field::HEADER_LEN];
        bytes[field::MAGIC].copy_from_slice(&field::MAGIC_BYTES);
        let kind = if self.kind == Kind::Recursive.id() {
            Kind::Recursive
        } else {
            Kind::Memoryless
        };
        let version = kind.oldest_version(self.parameters.len(), self.activation);
        bytes[field::VERSION].copy_from_slice(&version.to_le_bytes());
        bytes[field::KIND] = self.kind;
        bytes[field::UNITS] = field::UNITS_SI;
        bytes[field::FEATURES] = self.features;
        bytes[field::NETWORKS] = self.networks.len() as u8;
        bytes[field::INPUTS] = self.inputs.len() as u8;
        bytes[field::OUTPUTS] = (self.outputs.len() / self.networks.len()) as u8;
        bytes[field::PASSES].copy_from_slice(&self.passes.to_le_bytes());
        bytes[field::PARAMETERS].copy_from_slice(&(self.parameters.len() as u16).to_le_bytes());
        let normalisation = self.inputs.iter().chain(&self.outputs).flatten();
        for value in self.parameters.iter().chain(normalisation) {
            bytes.extend(value.to_le_bytes());
        }
        let tables: usize = self
            .networks
            .iter()
            .map(|layers| field::NETWORK_ENTRY_LEN + field::LAYER_ENTRY_LEN * layers.len())
            .sum();
        let data_start = bytes.len() + tables;
        let mut data = Vec::new();
        for layers in &self.networks {
            bytes.extend((layers.len() as u16).to_le_bytes());
            bytes.extend([self.activation.id(), 0]);
            for layer in layers {
                bytes.extend((layer.inputs as u16).to_le_bytes());
                bytes.extend((layer.outputs as u16).to_le_bytes());
                bytes.extend(((data_start + data.len()) as u32).to_le_bytes());
                bytes.extend(layer.variance_max.to_le_bytes());
                data.extend(layer.data());
            }
        }
        bytes.extend(data);
        let length = bytes.len() as u32;
        bytes[field::LENGTH].copy_from_slice(&length.to_le_bytes());
        sealed(bytes)
    }
}

/// `bytes` with their checksum made right.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&bytes).to_le_bytes();
    bytes[field::CRC].copy_from_slice(&sum);
    bytes
}

fn layers(widths: &[usize], rng: &mut Generator) -> Vec<DraftLayer> {
    let pairs = widths.windows(2);
    pairs
        .map(|pair| DraftLayer::random(pair[0], pair[1], rng))
        .collect()
}
