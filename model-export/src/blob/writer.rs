//! Writes blobs: the only place that puts bytes where `bnkf::blob` reads them.

use bnkf::blob::{Activation, Blob, BlobError, FeatureLayout, Kind, checksum, field};

use crate::blob::quantise::QuantisedLayer;

/// Mean and scale of one input or output. Inputs are `(value - mean) / scale` to the network,
/// outputs `mean + scale * value` from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// Mean.
    pub mean: f32,
    /// Scale.
    pub scale: f32,
}

/// Everything that a blob holds.
#[derive(Clone, Debug, PartialEq)]
pub struct BlobContents {
    /// What the networks estimate.
    pub kind: Kind,
    /// What their inputs are.
    pub features: FeatureLayout,
    /// What every layer but the last ends in.
    pub activation: Activation,
    /// Monte Carlo passes by default.
    pub passes: u16,
    /// Parameters of the kind, in the order of `firmware/BLOB.md`.
    pub parameters: Vec<f32>,
    /// One for each input.
    pub inputs: Vec<Normalisation>,
    /// One for each output, networks in order.
    pub outputs: Vec<Normalisation>,
    /// Layers of each network.
    pub networks: Vec<Vec<QuantisedLayer>>,
}

/// The bytes of a blob, checked by reading them back.
///
/// # Errors
/// What the reader says of contents that no blob can hold: a scale that is not positive, a layer
/// too wide, a number of outputs that does not fit the kind.
pub fn write_blob(contents: &BlobContents) -> Result<Vec<u8>, BlobError> {
    let outputs = contents.outputs.len() / contents.networks.len().max(1);
    let mut bytes = vec![0; field::HEADER_LEN];
    bytes[field::MAGIC].copy_from_slice(&field::MAGIC_BYTES);
    let parameters = contents.parameters.len();
    let version = contents
        .kind
        .oldest_version(parameters, contents.activation);
    bytes[field::VERSION].copy_from_slice(&version.to_le_bytes());
    bytes[field::KIND] = contents.kind.id();
    bytes[field::UNITS] = field::UNITS_SI;
    bytes[field::FEATURES] = contents.features.id();
    // Counts beyond a byte become 255, which no field allows.
    let count = |count: usize| u8::try_from(count).unwrap_or(u8::MAX);
    bytes[field::NETWORKS] = count(contents.networks.len());
    bytes[field::INPUTS] = count(contents.inputs.len());
    bytes[field::OUTPUTS] = count(outputs);
    bytes[field::PASSES].copy_from_slice(&contents.passes.to_le_bytes());
    let parameters = u16::try_from(parameters).unwrap_or(u16::MAX);
    bytes[field::PARAMETERS].copy_from_slice(&parameters.to_le_bytes());
    floats(&mut bytes, &contents.parameters);
    for input in &contents.inputs {
        floats(&mut bytes, &[input.mean, 1.0 / input.scale]);
    }
    for output in &contents.outputs {
        floats(&mut bytes, &[output.mean, output.scale]);
    }
    layer_tables(&mut bytes, contents.activation, &contents.networks);
    for layer in contents.networks.iter().flatten() {
        bytes.extend(layer.mean_codes.iter().map(|code| code.to_le_bytes()[0]));
        bytes.extend(&layer.variance_codes);
        for values in [&layer.channel_scale, &layer.bias_mean, &layer.bias_variance] {
            floats(&mut bytes, values);
        }
    }
    let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
    bytes[field::LENGTH].copy_from_slice(&length.to_le_bytes());
    let sum = checksum(&bytes).to_le_bytes();
    bytes[field::CRC].copy_from_slice(&sum);
    Blob::parse(&bytes)?;
    Ok(bytes)
}

fn layer_tables(bytes: &mut Vec<u8>, activation: Activation, networks: &[Vec<QuantisedLayer>]) {
    let tables: usize = networks
        .iter()
        .map(|layers| field::NETWORK_ENTRY_LEN + layers.len() * field::LAYER_ENTRY_LEN)
        .sum();
    let mut offset = bytes.len() + tables;
    let short = |value: usize| u16::try_from(value).unwrap_or(u16::MAX).to_le_bytes();
    for layers in networks {
        bytes.extend(short(layers.len()));
        bytes.extend([activation.id(), 0]);
        for layer in layers {
            let mut entry = [0; field::LAYER_ENTRY_LEN];
            entry[field::LAYER_INPUTS].copy_from_slice(&short(layer.inputs));
            entry[field::LAYER_OUTPUTS].copy_from_slice(&short(layer.outputs));
            let start = u32::try_from(offset).unwrap_or(u32::MAX);
            entry[field::LAYER_OFFSET].copy_from_slice(&start.to_le_bytes());
            entry[field::LAYER_VARIANCE_MAX].copy_from_slice(&layer.variance_max.to_le_bytes());
            bytes.extend(entry);
            offset += field::layer_len(layer.inputs, layer.outputs);
        }
    }
}

fn floats(bytes: &mut Vec<u8>, values: &[f32]) {
    for value in values {
        bytes.extend(value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::quantise::quantise;
    use crate::posterior::architecture::Architecture;
    use crate::posterior::gaussian_weights::GaussianWeights;
    use crate::random_source::RandomSource;

    fn contents(networks: usize, outputs: usize) -> BlobContents {
        let architecture = Architecture::new(vec![13, 10, outputs]).expect("small");
        let network = |id| {
            let mut random = RandomSource::new(3, &[id]);
            quantise(&GaussianWeights::random(&architecture, 0.01, &mut random))
        };
        BlobContents {
            kind: Kind::Memoryless,
            features: FeatureLayout::Polar13,
            activation: Activation::Gelu,
            passes: 100,
            parameters: vec![1.5, 2.5],
            inputs: vec![
                Normalisation {
                    mean: 0.5,
                    scale: 4.0
                };
                13
            ],
            outputs: vec![
                Normalisation {
                    mean: -2.0,
                    scale: 20.0
                };
                networks * outputs
            ],
            networks: (0..networks as u64).map(network).collect(),
        }
    }

    #[test]
    fn what_is_written_is_what_is_read() {
        for (networks, outputs) in [(1, 3), (3, 1)] {
            let contents = contents(networks, outputs);
            let bytes = write_blob(&contents).expect("valid");
            let blob = Blob::parse(&bytes).expect("valid");
            assert_eq!(blob.network_count(), networks);
            assert_eq!(blob.outputs(), outputs);
            assert_eq!(blob.input_normalisation().get(3), 0.25);
            assert_eq!(blob.output_normalisation().get(1), 20.0);
            for (view, layers) in blob.networks().zip(&contents.networks) {
                for (index, layer) in layers.iter().enumerate() {
                    let read = view.layer(index);
                    assert_eq!((read.inputs, read.outputs), (layer.inputs, layer.outputs));
                    assert_eq!(read.variance_codes, layer.variance_codes);
                    assert_eq!(read.variance_max, layer.variance_max);
                    let codes: Vec<i8> = read.means.iter().map(|&code| code as i8).collect();
                    assert_eq!(codes, layer.mean_codes);
                    assert_eq!(read.bias_mean.iter().collect::<Vec<_>>(), layer.bias_mean);
                }
            }
        }
    }

    #[test]
    fn an_activation_makes_it_version_three() {
        let gelu = contents(1, 3);
        let bytes = write_blob(&gelu).expect("valid");
        assert_eq!(Blob::parse(&bytes).expect("valid").version(), 2);
        for activation in [Activation::Relu, Activation::Tanh, Activation::Identity] {
            let contents = BlobContents {
                activation,
                ..gelu.clone()
            };
            let bytes = write_blob(&contents).expect("valid");
            let blob = Blob::parse(&bytes).expect("valid");
            assert_eq!(blob.version(), 3);
            let network = blob.networks().next().expect("one");
            assert_eq!(network.activation(), activation);
        }
    }

    #[test]
    fn contents_that_no_blob_can_hold_are_refused() {
        let valid = contents(1, 3);
        let damaged = |damage: fn(&mut BlobContents)| {
            let mut contents = valid.clone();
            damage(&mut contents);
            write_blob(&contents).expect_err("refused").to_string()
        };
        assert!(damaged(|c| c.passes = 0).contains("passes"));
        assert!(damaged(|c| c.parameters[0] = 0.0).contains("parameter out of range"));
        assert!(damaged(|c| c.inputs[0].scale = 0.0).contains("input normalisation"));
        assert!(damaged(|c| c.outputs[0].mean = f32::NAN).contains("output normalisation"));
        assert!(damaged(|c| c.networks[0][0].bias_mean[0] = f32::NAN).contains("bias mean"));
        assert!(damaged(|c| c.networks.clear()).contains("network count"));
    }
}
