//! The blob reader against bytes that an independent writer made, and against hostile bytes.

use bnkf::blob::{Blob, BlobError, FeatureLayout, Kind, checksum, field};
use bnkf::rng::seeded;
use rand_core::Rng;

const BNKF: &[u8] = include_bytes!("golden/tiny_bnkf.bnkf");
const BNKFE: &[u8] = include_bytes!("golden/tiny_bnkfe.bnkf");

fn with_checksum(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&bytes).to_le_bytes();
    bytes[field::CRC].copy_from_slice(&sum);
    bytes
}

#[test]
fn golden_bytes_read_as_they_were_written() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("golden/torch_blob.json")).expect("valid JSON");
    let blob = Blob::parse(BNKF).expect("golden blob parses");
    assert_eq!(blob.kind(), Kind::Memoryless);
    assert_eq!(blob.features(), FeatureLayout::Polar13);
    assert_eq!(
        (blob.network_count(), blob.outputs(), blob.passes()),
        (1, 3, 100)
    );
    assert_eq!(blob.parameters().iter().collect::<Vec<_>>(), [1.5, 2.5]);
    assert_eq!(blob.input_normalisation().get(2 * 12), 0.25 * 12.0);
    assert_eq!(blob.output_normalisation().get(5), 5.0);
    let network = blob.networks().next().expect("one network");
    assert_eq!(network.layers(), 3);
    for index in 0..3 {
        let layer = network.layer(index);
        let expected = &golden["joint_weights"][index];
        for output in 0..layer.outputs {
            for input in 0..layer.inputs {
                let mean = expected["mean"][output][input].as_f64().expect("number");
                let variance = expected["variance"][output][input]
                    .as_f64()
                    .expect("number");
                // One rounding of f32, and of exp2f.
                assert!((f64::from(layer.mean(output, input)) - mean).abs() <= 1e-7 * mean.abs());
                let read = f64::from(layer.variance(output, input));
                assert!((read - variance).abs() <= 4e-7 * variance);
            }
        }
    }
    let ensemble = Blob::parse(BNKFE).expect("golden blob parses");
    assert_eq!((ensemble.network_count(), ensemble.outputs()), (3, 1));
    assert_eq!(ensemble.networks().count(), 3);
}

#[test]
fn every_truncation_is_refused() {
    for bytes in [BNKF, BNKFE] {
        for length in 0..bytes.len() {
            assert!(
                Blob::parse(&bytes[..length]).is_err(),
                "{length} bytes were accepted"
            );
        }
        let longer = [bytes, &[0]].concat();
        assert!(matches!(
            Blob::parse(&longer),
            Err(BlobError::WrongLength { .. })
        ));
    }
}

#[test]
fn every_single_bit_flip_is_refused() {
    for bytes in [BNKF, BNKFE] {
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.to_vec();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(Blob::parse(&flipped).is_err(), "bit {bit} was accepted");
        }
    }
}

/// With the checksum made right again the fields themselves must be checked: every flip of a
/// header or table bit gives an error or a blob whose every accessor works.
#[test]
fn flips_behind_a_valid_checksum_never_panic() {
    let mut refused = 0;
    for bytes in [BNKF, BNKFE] {
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.to_vec();
            flipped[bit / 8] ^= 1 << (bit % 8);
            match Blob::parse(&with_checksum(flipped)) {
                Ok(blob) => touch(&blob),
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 500, "only {refused} flips were refused");
}

#[test]
fn random_bytes_never_panic() {
    let mut rng = seeded(77);
    for round in 0..10_000_u32 {
        let mut bytes = BNKF.to_vec();
        // Half of the rounds keep the golden frame and damage some bytes, half are noise.
        if round % 2 == 0 {
            for _ in 0..=rng.next_u32() % 16 {
                let at = rng.next_u32() as usize % bytes.len();
                bytes[at] = rng.next_u32() as u8;
            }
        } else {
            bytes.truncate(field::HEADER_LEN + rng.next_u32() as usize % 400);
            rng.fill_bytes(&mut bytes);
            bytes[field::MAGIC].copy_from_slice(&field::MAGIC_BYTES);
            let version = field::VERSION_GELU + (round / 2 % 3) as u16;
            bytes[field::VERSION].copy_from_slice(&version.to_le_bytes());
            let length = (bytes.len() as u32).to_le_bytes();
            bytes[field::LENGTH].copy_from_slice(&length);
        }
        assert!(Blob::parse(&bytes).is_err() || bytes == BNKF);
        if let Ok(blob) = Blob::parse(&with_checksum(bytes)) {
            touch(&blob);
        }
    }
}

#[test]
fn errors_name_what_is_wrong() {
    let with = |at: usize, value: u8| {
        let mut bytes = BNKF.to_vec();
        bytes[at] = value;
        Blob::parse(&with_checksum(bytes))
            .expect_err("refused")
            .to_string()
    };
    assert_eq!(with(0, b'X'), "not a BNKF blob (wrong first bytes)");
    assert_eq!(with(4, 1), "unknown blob version 1");
    assert_eq!(with(field::KIND, 9), "blob field out of range: kind");
    assert_eq!(with(field::UNITS, 0), "blob field out of range: units");
    assert_eq!(
        with(field::FEATURES, 1),
        "blob field out of range: input count"
    );
    assert_eq!(
        with(field::NETWORKS, 2),
        "blob field out of range: network count"
    );
    assert_eq!(
        with(field::OUTPUTS, 4),
        "blob field out of range: output count"
    );
    let mut zero_passes = BNKF.to_vec();
    zero_passes[field::PASSES].fill(0);
    let error = Blob::parse(&with_checksum(zero_passes)).expect_err("refused");
    assert_eq!(error.to_string(), "blob field out of range: default passes");
    let mut broken = BNKF.to_vec();
    broken[500] ^= 1;
    assert_eq!(
        Blob::parse(&broken).unwrap_err().to_string(),
        "blob checksum does not match"
    );
}

/// Reads everything that a view offers.
fn touch(blob: &Blob<'_>) {
    let mut sum = blob.parameters().iter().sum::<f32>();
    sum += blob.input_normalisation().iter().sum::<f32>();
    sum += blob.output_normalisation().iter().sum::<f32>();
    for network in blob.networks() {
        for index in 0..network.layers() {
            let layer = network.layer(index);
            for output in 0..layer.outputs {
                sum += layer.bias_mean.get(output) + layer.bias_variance.get(output);
                for input in 0..layer.inputs {
                    sum += layer.mean(output, input) + layer.variance(output, input);
                }
            }
        }
    }
    std::hint::black_box(sum);
}
