use super::draft::{Draft, sealed};
use super::{Activation, Blob, BlobError, BlobField, FeatureLayout, Kind, checksum, field};
use std::vec::Vec;

fn refusal(draft: &Draft) -> BlobError {
    Blob::parse(&draft.bytes()).expect_err("refused")
}

/// The blob of `draft` with `change` made to its bytes and the checksum put right.
fn changed(draft: &Draft, change: impl Fn(&mut Vec<u8>)) -> Result<(), BlobError> {
    let mut bytes = draft.bytes();
    change(&mut bytes);
    Blob::parse(&sealed(bytes)).map(|_| ())
}

fn invalid(field: BlobField) -> Result<(), BlobError> {
    Err(BlobError::Invalid(field))
}

/// Offset of the first network's table.
fn table_at(draft: &Draft) -> usize {
    let pairs = draft.inputs.len() + draft.outputs.len();
    field::HEADER_LEN + 4 * draft.parameters.len() + 8 * pairs
}

#[test]
fn what_was_written_is_what_is_read() {
    let cases = [
        (
            Draft::memoryless(&[12, 6, 3], 1),
            Kind::Memoryless,
            FeatureLayout::Polar12,
        ),
        (Draft::ensemble(2), Kind::Memoryless, FeatureLayout::Polar12),
        (
            Draft::recursive(3),
            Kind::Recursive,
            FeatureLayout::Recursive64,
        ),
    ];
    for (draft, kind, features) in cases {
        let bytes = draft.bytes();
        let blob = Blob::parse(&bytes).expect("a good blob");
        assert_eq!((blob.kind(), blob.features()), (kind, features));
        assert_eq!((kind.id(), features.id()), (draft.kind, draft.features));
        assert_eq!(features.len(), draft.inputs.len());
        assert_eq!(blob.passes(), draft.passes);
        assert_eq!(blob.network_count(), draft.networks.len());
        assert_eq!(blob.outputs(), draft.outputs.len() / draft.networks.len());
        assert_eq!(blob.checksum(), checksum(&bytes));
        let parameters: Vec<f32> = blob.parameters().iter().collect();
        assert_eq!(parameters, draft.parameters);
        let inputs: Vec<f32> = blob.input_normalisation().iter().collect();
        let pairs: Vec<[f32; 2]> = blob.input_normalisation().pairs().collect();
        assert_eq!(pairs.as_flattened(), inputs);
        assert_eq!(inputs, draft.inputs.as_flattened());
        let outputs: Vec<f32> = blob.output_normalisation().iter().collect();
        assert_eq!(outputs, draft.outputs.as_flattened());
        assert_eq!(blob.networks().count(), draft.networks.len());
        for (network, layers) in blob.networks().zip(&draft.networks) {
            assert_eq!(network.layers(), layers.len());
            for (index, layer) in layers.iter().enumerate() {
                let view = network.layer(index);
                assert_eq!((view.inputs, view.outputs), (layer.inputs, layer.outputs));
                assert_eq!(view.variance_max, layer.variance_max);
                let floats = [view.channel_scale, view.bias_mean, view.bias_variance];
                let [scale, bias_mean, bias_variance] =
                    floats.map(|floats| floats.iter().collect::<Vec<f32>>());
                assert_eq!(scale, layer.channel_scale);
                assert_eq!(bias_mean, layer.bias_mean);
                assert_eq!(bias_variance, layer.bias_variance);
                for output in 0..layer.outputs {
                    for input in 0..layer.inputs {
                        let mean = f64::from(view.mean(output, input));
                        assert!((mean - layer.mean(output, input)).abs() < 1e-6);
                        let variance = f64::from(view.variance(output, input));
                        let expected = layer.variance(output, input);
                        assert!((variance - expected).abs() <= 1e-6 * expected);
                    }
                }
            }
        }
    }
}

/// Version 2 is GELU and nothing else; versions 3 and 4 name it.
#[test]
fn what_follows_hidden_layers_is_read_and_checked() {
    let draft = Draft::memoryless(&[12, 6, 3], 1);
    let at = table_at(&draft) + 2;
    let read = |version: u16, id: u8, padding: u8| {
        let mut bytes = draft.bytes();
        bytes[field::VERSION].copy_from_slice(&version.to_le_bytes());
        bytes[at..at + 2].copy_from_slice(&[id, padding]);
        let bytes = sealed(bytes);
        let blob = Blob::parse(&bytes)?;
        assert_eq!(blob.version(), version);
        Ok(blob.networks().next().expect("one").activation())
    };
    let all = [
        Activation::Gelu,
        Activation::Relu,
        Activation::Tanh,
        Activation::Identity,
    ];
    for (id, activation) in (0..).zip(all) {
        assert_eq!(activation.id(), id);
        assert_eq!(read(3, id, 0), Ok(activation));
        assert_eq!(read(4, id, 0), Ok(activation));
        let padding = Err(BlobError::Invalid(BlobField::Padding));
        assert_eq!(read(3, id, 1), padding);
        let of_two = if id == 0 { Ok(activation) } else { padding };
        assert_eq!(read(2, id, 0), of_two);
    }
    for id in [4, 255] {
        assert_eq!(
            read(3, id, 0),
            Err(BlobError::Invalid(BlobField::Activation))
        );
    }
    for version in [0, 1, 5, 0x0300] {
        assert_eq!(read(version, 0, 0), Err(BlobError::UnknownVersion(version)));
    }
}

#[test]
fn a_recursive_network_ends_in_gelu() {
    let mut draft = Draft::recursive(3);
    draft.activation = Activation::Relu;
    assert_eq!(refusal(&draft), BlobError::Invalid(BlobField::Activation));
}

#[test]
fn a_variance_code_of_zero_is_no_variance() {
    let mut draft = Draft::memoryless(&[12, 3], 4);
    draft.networks[0][0].variance_codes[12 + 5] = 0;
    let bytes = draft.bytes();
    let layer = Blob::parse(&bytes)
        .unwrap()
        .networks()
        .next()
        .unwrap()
        .layer(0);
    assert_eq!(layer.variance(1, 5), 0.0);
    assert!(layer.variance(1, 4) > 0.0);
}

#[test]
fn floats_know_their_number() {
    let bytes = Draft::recursive(5).bytes();
    let parameters = Blob::parse(&bytes).unwrap().parameters();
    assert_eq!(parameters.len(), 32);
    assert!(!parameters.is_empty());
    let all: Vec<f32> = (0..32).map(|index| parameters.get(index)).collect();
    assert_eq!(all, parameters.iter().collect::<Vec<f32>>());
    assert!(super::Floats(&[]).is_empty());
}

#[test]
fn layouts_and_rows_have_the_documented_sizes() {
    let lengths = [
        (FeatureLayout::Polar12, 12),
        (FeatureLayout::Polar13, 13),
        (FeatureLayout::Recursive64, 64),
    ];
    for (layout, length) in lengths {
        assert_eq!((layout.len(), layout.is_empty()), (length, false));
    }
    for (inputs, stride) in [(1, 4), (4, 4), (5, 8), (64, 64)] {
        assert_eq!(field::row_stride(inputs), stride);
        // Means and codes, then scale, bias mean and bias variance of each output.
        let expected = 3 * stride + 3 * stride + 3 * 4 + 3 * 4 + 3 * 4;
        assert_eq!(field::layer_len(inputs, 3), expected);
    }
}

#[test]
fn the_frame_is_checked_first() {
    let bytes = Draft::memoryless(&[12, 3], 6).bytes();
    let length = bytes.len();
    let given = field::HEADER_LEN - 1;
    assert_eq!(
        Blob::parse(&bytes[..given]).unwrap_err(),
        BlobError::Truncated {
            needed: field::HEADER_LEN,
            given
        }
    );
    // The header alone: the length field asks for more.
    for given in [field::HEADER_LEN, length - 1] {
        let needed = length;
        let error = Blob::parse(&bytes[..given]).unwrap_err();
        assert_eq!(error, BlobError::Truncated { needed, given });
    }
    let longer = [&bytes[..], &[0]].concat();
    assert_eq!(
        Blob::parse(&longer).unwrap_err(),
        BlobError::WrongLength {
            header: length,
            given: length + 1
        }
    );
    let with = |at: usize, value: u8| {
        let mut other = bytes.clone();
        other[at] = value;
        Blob::parse(&other).unwrap_err()
    };
    assert_eq!(with(0, b'X'), BlobError::NotABlob);
    assert_eq!(with(4, 7), BlobError::UnknownVersion(7));
    assert_eq!(
        with(length - 1, bytes[length - 1] ^ 1),
        BlobError::WrongChecksum
    );
    assert_eq!(
        with(field::CRC.start, bytes[12] ^ 1),
        BlobError::WrongChecksum
    );
}

#[test]
fn bytes_beyond_the_last_layer_are_refused() {
    let draft = Draft::memoryless(&[12, 3], 7);
    let length = draft.bytes().len();
    let longer = changed(&draft, |bytes| {
        bytes.extend([0; 4]);
        bytes[field::LENGTH].copy_from_slice(&(length as u32 + 4).to_le_bytes());
    });
    let error = BlobError::WrongLength {
        header: length + 4,
        given: length,
    };
    assert_eq!(longer, Err(error));
}

#[test]
fn data_that_ends_early_is_refused() {
    let draft = Draft::memoryless(&[12, 3], 8);
    let length = draft.bytes().len();
    let shorter = changed(&draft, |bytes| {
        bytes.truncate(length - 4);
        bytes[field::LENGTH].copy_from_slice(&(length as u32 - 4).to_le_bytes());
    });
    let error = BlobError::Truncated {
        needed: length,
        given: length - 4,
    };
    assert_eq!(shorter, Err(error));
}

#[test]
fn every_header_field_names_itself() {
    let memoryless = Draft::memoryless(&[12, 3], 9);
    let recursive = Draft::recursive(9);
    let set = |draft: &Draft, at: usize, value: u8| changed(draft, |bytes| bytes[at] = value);
    for draft in [&memoryless, &recursive] {
        assert_eq!(set(draft, field::KIND, 0), invalid(BlobField::Kind));
        assert_eq!(set(draft, field::KIND, 3), invalid(BlobField::Kind));
        assert_eq!(set(draft, field::UNITS, 2), invalid(BlobField::Units));
        assert_eq!(set(draft, field::FEATURES, 0), invalid(BlobField::Features));
        assert_eq!(set(draft, field::FEATURES, 4), invalid(BlobField::Features));
        assert_eq!(set(draft, field::INPUTS, 11), invalid(BlobField::Inputs));
        assert_eq!(set(draft, field::NETWORKS, 2), invalid(BlobField::Networks));
        assert_eq!(set(draft, field::NETWORKS, 0), invalid(BlobField::Networks));
        assert_eq!(set(draft, field::OUTPUTS, 2), invalid(BlobField::Outputs));
        assert_eq!(
            set(draft, field::PARAMETERS.start, 3),
            invalid(BlobField::Parameters)
        );
    }
    // A layout of the other kind, and numbers of networks and outputs of the other kind.
    assert_eq!(
        set(&memoryless, field::FEATURES, 3),
        invalid(BlobField::Features)
    );
    assert_eq!(
        set(&memoryless, field::FEATURES, 2),
        invalid(BlobField::Inputs)
    );
    assert_eq!(
        set(&recursive, field::FEATURES, 1),
        invalid(BlobField::Features)
    );
    assert_eq!(
        set(&recursive, field::NETWORKS, 3),
        invalid(BlobField::Networks)
    );
    assert_eq!(
        set(&recursive, field::OUTPUTS, 3),
        invalid(BlobField::Outputs)
    );
    assert_eq!(
        set(&memoryless, field::NETWORKS, 3),
        invalid(BlobField::Outputs)
    );
    assert_eq!(
        set(&memoryless, field::OUTPUTS, 1),
        invalid(BlobField::Outputs)
    );
    assert_eq!(
        set(&memoryless, field::OUTPUTS, 26),
        invalid(BlobField::Outputs)
    );
}

#[test]
fn passes_lie_between_1_and_the_limit() {
    let with = |passes| Draft {
        passes,
        ..Draft::memoryless(&[12, 3], 10)
    };
    for passes in [1, field::PASSES_MAX] {
        assert_eq!(changed(&with(passes), |_| ()), Ok(()));
    }
    for passes in [0, field::PASSES_MAX + 1] {
        assert_eq!(
            refusal(&with(passes)),
            BlobError::Invalid(BlobField::Passes)
        );
    }
}

/// A version says how many parameters there are, one for one.
#[test]
fn every_version_has_its_parameters() {
    for (version, expected) in [(2, 32), (3, 32), (4, 33)] {
        for count in 31..35 {
            let mut draft = Draft::recursive(12);
            draft.parameters.resize(count, 0.5);
            let read = changed(&draft, |bytes| {
                bytes[field::VERSION].copy_from_slice(&u16::to_le_bytes(version));
            });
            let refused = Err(BlobError::Invalid(BlobField::Parameters));
            let right = if count == expected { Ok(()) } else { refused };
            assert_eq!(read, right, "version {version}, {count} parameters");
        }
        assert_eq!(Kind::Recursive.parameters(version), expected);
        assert_eq!(Kind::Memoryless.parameters(version), 2);
    }
}

/// Each parameter at its limits, just outside them, and at what is no number at all.
#[test]
fn parameters_are_refused_by_name_outside_their_limits() {
    let drafts = [
        (Draft::memoryless(&[12, 3], 11), Kind::Memoryless),
        (Draft::recursive(11), Kind::Recursive),
    ];
    for (mut draft, kind) in drafts {
        // A version of before holds the first of them.
        draft.parameters.resize(kind.parameter_limits().len(), 1.0);
        for (index, limits) in kind.parameter_limits().iter().enumerate() {
            let read = |value: f32| {
                let mut other = draft.clone();
                other.parameters[index] = value;
                changed(&other, |_| ())
            };
            assert_eq!(read(limits.least), Ok(()));
            assert_eq!(read(limits.most), Ok(()));
            // A limit of zero has no hundredth.
            let below = limits.least - (limits.least.abs() * 0.01).max(1e-12);
            let above = limits.most * 1.01;
            for bad in [below, above, 1e38, -1e38, f32::NAN, f32::INFINITY] {
                assert_eq!(read(bad), Err(BlobError::Parameter(limits.name)), "{bad}");
            }
        }
    }
}

#[test]
fn normalisations_are_finite_and_scales_positive() {
    let draft = Draft::memoryless(&[12, 3], 12);
    for bad in [
        [f32::NAN, 1.0],
        [f32::INFINITY, 1.0],
        [0.0, f32::NAN],
        [0.0, f32::INFINITY],
        [0.0, 0.0],
        [0.0, -1.0],
    ] {
        for index in [0, 11] {
            let mut other = draft.clone();
            other.inputs[index] = bad;
            let expected = BlobError::Invalid(BlobField::InputNormalisation);
            assert_eq!(refusal(&other), expected, "{bad:?}");
        }
        for index in [0, 2] {
            let mut other = draft.clone();
            other.outputs[index] = bad;
            let expected = BlobError::Invalid(BlobField::OutputNormalisation);
            assert_eq!(refusal(&other), expected, "{bad:?}");
        }
    }
}

#[test]
fn a_network_has_one_to_eight_layers() {
    let of = |layers: usize| {
        let mut widths = std::vec![12];
        widths.extend(std::iter::repeat_n(2, layers - 1));
        widths.push(3);
        Draft::memoryless(&widths, 13)
    };
    for layers in [1, field::LAYERS_MAX] {
        assert_eq!(changed(&of(layers), |_| ()), Ok(()));
    }
    let too_many = refusal(&of(field::LAYERS_MAX + 1));
    assert_eq!(too_many, BlobError::Invalid(BlobField::Layers));
    let draft = of(1);
    let at = table_at(&draft);
    assert_eq!(changed(&draft, |b| b[at] = 0), invalid(BlobField::Layers));
    for padding in [at + 2, at + 3] {
        let read = changed(&draft, |bytes| bytes[padding] = 1);
        assert_eq!(read, invalid(BlobField::Padding));
    }
}

#[test]
fn layers_fit_together() {
    for width in [1, field::WIDTH_MAX] {
        let draft = Draft::memoryless(&[12, width, 3], 14);
        assert_eq!(changed(&draft, |_| ()), Ok(()));
    }
    let wide = Draft::memoryless(&[12, field::WIDTH_MAX + 1, 3], 14);
    assert_eq!(refusal(&wide), BlobError::Invalid(BlobField::LayerSize));

    let draft = Draft::memoryless(&[12, 5, 3], 14);
    let first = table_at(&draft) + field::NETWORK_ENTRY_LEN;
    let second = first + field::LAYER_ENTRY_LEN;
    let set = |at: usize, value: u8| changed(&draft, |bytes| bytes[at] = value);
    assert_eq!(set(first, 11), invalid(BlobField::LayerSize));
    assert_eq!(
        set(first + field::LAYER_OUTPUTS.start, 0),
        invalid(BlobField::LayerSize)
    );
    assert_eq!(set(second, 6), invalid(BlobField::LayerSize));
    for entry in [first, second] {
        let at = entry + field::LAYER_OFFSET.start;
        let shifted = changed(&draft, |bytes| bytes[at] ^= 4);
        assert_eq!(shifted, invalid(BlobField::LayerOffset));
    }

    // The last layer must end at the header's outputs.
    let mut other = Draft::memoryless(&[12, 5, 2], 14);
    other.outputs.push([0.0, 1.0]);
    assert_eq!(refusal(&other), BlobError::Invalid(BlobField::Outputs));
}

#[test]
fn numbers_of_a_layer_are_finite_and_sizes_not_negative() {
    let draft = Draft::memoryless(&[12, 5, 3], 15);
    let set = |change: &dyn Fn(&mut super::draft::DraftLayer, f32), value: f32| {
        let mut other = draft.clone();
        change(&mut other.networks[0][1], value);
        changed(&other, |_| ())
    };
    type Change<'a> = &'a dyn Fn(&mut super::draft::DraftLayer, f32);
    let sizes: [(BlobField, Change<'_>); 3] = [
        (BlobField::VarianceMax, &|layer, value| {
            layer.variance_max = value
        }),
        (BlobField::ChannelScale, &|layer, value| {
            layer.channel_scale[2] = value
        }),
        (BlobField::BiasVariance, &|layer, value| {
            layer.bias_variance[2] = value
        }),
    ];
    for (name, change) in sizes {
        assert_eq!(set(change, 0.0), Ok(()));
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(set(change, bad), invalid(name), "{bad}");
        }
    }
    let bias: Change<'_> = &|layer, value| layer.bias_mean[2] = value;
    assert_eq!(set(bias, -1.0), Ok(()));
    for bad in [f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(set(bias, bad), invalid(BlobField::BiasMean));
    }
}

#[test]
fn the_padding_of_every_row_is_zero() {
    // Rows of five in eight bytes: three of means, then three of codes.
    let draft = Draft::memoryless(&[12, 5, 3], 16);
    let tables = field::NETWORK_ENTRY_LEN + 2 * field::LAYER_ENTRY_LEN;
    let second = table_at(&draft) + tables + field::layer_len(12, 5);
    for row in 0..6 {
        for column in 0..8 {
            let at = second + 8 * row + column;
            let expected = if column < 5 {
                Ok(())
            } else {
                invalid(BlobField::Padding)
            };
            assert_eq!(changed(&draft, |bytes| bytes[at] = 9), expected);
        }
    }
}
