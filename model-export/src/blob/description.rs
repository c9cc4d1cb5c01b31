//! A blob in words and tables, for people.

use crate::flights::data_hash;
use bnkf::blob::{Blob, FeatureLayout, Kind, LayerView, NetworkView, field};

const POLAR: [(&str, &str); 13] = [
    ("previous range", "m"),
    ("previous elevation", "rad"),
    ("previous azimuth", "rad"),
    ("previous range-rate", "m/s"),
    ("range", "m"),
    ("elevation", "rad"),
    ("azimuth", "rad"),
    ("range-rate", "m/s"),
    ("sigma range", "m"),
    ("sigma elevation", "rad"),
    ("sigma azimuth", "rad"),
    ("sigma range-rate", "m/s"),
    ("time between", "s"),
];

/// Characters of the longest parameter's name.
const PARAMETER: usize = 40;

/// Everything that the blob in `bytes` says: header, units, parameters, normalisation, layers, sizes and the
/// distribution of the standard deviations. `blob` is the view over `bytes`.
#[must_use]
pub fn describe(bytes: &[u8], blob: &Blob<'_>) -> String {
    let mut text = header(bytes, blob);
    text += &parameters(blob);
    text += &normalisation(blob);
    for (index, network) in blob.networks().enumerate() {
        text += &layers(index, network);
    }
    text + &histogram(blob)
}

fn header(bytes: &[u8], blob: &Blob<'_>) -> String {
    let kind = match (blob.kind(), blob.network_count()) {
        (Kind::Memoryless, 1) => "memoryless, one network for three axes (BNN, BNKF)",
        (Kind::Memoryless, _) => "memoryless, one network for each axis (BNKFe)",
        (Kind::Recursive, _) => "recursive",
    };
    let features = match blob.features() {
        FeatureLayout::Polar12 => "polar-12",
        FeatureLayout::Polar13 => "polar-13",
        FeatureLayout::Recursive64 => "recursive-64",
    };
    let activations = blob
        .networks()
        .map(|network| network.activation().to_string());
    let mut activations: Vec<String> = activations.collect();
    activations.dedup();
    let activation = activations.join(", ");
    format!(
        "format      version {}, {} bytes\n\
         CRC-32      {:08x}\n\
         SHA-256     {}\n\
         kind        {kind}\n\
         features    {features} ({} inputs)\n\
         activation  {activation}\n\
         units       m, s, rad, m/s\n\
         passes      {}\n",
        blob.version(),
        bytes.len(),
        blob.checksum(),
        data_hash::of_bytes(bytes),
        blob.features().len(),
        blob.passes(),
    )
}

fn parameters(blob: &Blob<'_>) -> String {
    let mut text = format!("\n{:<PARAMETER$}{:>12}\n", "parameter", "value");
    let limits = blob.kind().parameter_limits();
    for (value, limits) in blob.parameters().iter().zip(limits) {
        // `{:?}` is the shortest text that reads back as the same number, of any size.
        row(
            &mut text,
            &format!("{:<PARAMETER$}{:>12}", limits.name, format!("{value:?}")),
        );
    }
    text
}

fn normalisation(blob: &Blob<'_>) -> String {
    let mut text = format!("\n{:<22}{:>12}{:>12}\n", "input", "mean", "scale");
    let inputs = blob.input_normalisation();
    for index in 0..inputs.len() / 2 {
        let logarithms = blob.features() == FeatureLayout::Polar13 && (8..12).contains(&index);
        let name = match POLAR.get(index) {
            Some((name, unit)) if blob.kind() == Kind::Memoryless => {
                let ln = if logarithms { "ln " } else { "" };
                format!("{ln}{name}, {unit}")
            }
            _ => format!("input {index}"),
        };
        let (mean, scale) = (inputs.get(2 * index), 1.0 / inputs.get(2 * index + 1));
        row(&mut text, &format!("{name:<22}{mean:>12.5}{scale:>12.5}"));
    }
    row(
        &mut text,
        &format!("\n{:<22}{:>12}{:>12}", "output", "mean", "scale"),
    );
    let outputs = blob.output_normalisation();
    for index in 0..outputs.len() / 2 {
        let name = match ["x, m", "y, m", "z, m"].get(index) {
            Some(name) if blob.kind() == Kind::Memoryless => (*name).to_owned(),
            _ => format!("output {index}"),
        };
        let (mean, scale) = (outputs.get(2 * index), outputs.get(2 * index + 1));
        row(&mut text, &format!("{name:<22}{mean:>12.5}{scale:>12.5}"));
    }
    text
}

fn layers(index: usize, network: NetworkView<'_>) -> String {
    let mut text = format!(
        "\nnetwork {index}\n{:>5}{:>9}{:>8}{:>12}{:>14}{:>14}{:>14}{:>9}\n",
        "layer", "shape", "bytes", "mean max", "sigma min", "sigma median", "sigma max", "zeros"
    );
    for number in 0..network.layers() {
        let layer = network.layer(number);
        let (mut sigmas, mut largest, mut zeros) = (Vec::new(), 0.0_f32, 0_usize);
        for_each_weight(&layer, |mean, variance| {
            largest = largest.max(mean.abs());
            if variance > 0.0 {
                sigmas.push(variance.sqrt());
            } else {
                zeros += 1;
            }
        });
        sigmas.sort_by(f32::total_cmp);
        let sigma = |at: usize| sigmas.get(at).copied().unwrap_or(0.0);
        let (low, middle, high) = (
            sigma(0),
            sigma(sigmas.len() / 2),
            sigma(sigmas.len().saturating_sub(1)),
        );
        let shape = format!("{}x{}", layer.outputs, layer.inputs);
        let bytes = field::layer_len(layer.inputs, layer.outputs);
        row(
            &mut text,
            &format!(
                "{number:>5}{shape:>9}{bytes:>8}{largest:>12.5}{low:>14.6}{middle:>14.6}{high:>14.6}{zeros:>9}"
            ),
        );
    }
    text
}

/// Weights per octave of their standard deviation.
fn histogram(blob: &Blob<'_>) -> String {
    let mut counts = std::collections::BTreeMap::<i32, usize>::new();
    let mut total = 0_usize;
    for network in blob.networks() {
        for number in 0..network.layers() {
            for_each_weight(&network.layer(number), |_, variance| {
                total += 1;
                if variance > 0.0 {
                    *counts
                        .entry(variance.sqrt().log2().floor() as i32)
                        .or_default() += 1;
                }
            });
        }
    }
    let mut text = format!("\nsigma of {total} weights\n");
    let most = counts.values().copied().max().unwrap_or(1);
    for (octave, count) in counts {
        let low = f64::from(octave).exp2();
        let bar = "#".repeat((40 * count).div_ceil(most));
        row(
            &mut text,
            &format!("{low:>10.6} to {:>10.6}{count:>8}  {bar}", 2.0 * low),
        );
    }
    text
}

fn for_each_weight(layer: &LayerView<'_>, mut each: impl FnMut(f32, f32)) {
    for output in 0..layer.outputs {
        for input in 0..layer.inputs {
            each(layer.mean(output, input), layer.variance(output, input));
        }
    }
}

fn row(text: &mut String, line: &str) {
    text.push_str(line.trim_end());
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::{PARAMETER, describe};
    use bnkf::blob::Blob;

    #[test]
    fn every_part_of_a_blob_shows() {
        let bytes = include_bytes!("../../../tests/golden/tiny_bnkfe.bnkf");
        let text = describe(bytes, &Blob::parse(bytes).unwrap());
        for part in [
            &format!("{} bytes", bytes.len()),
            "memoryless, one network for each axis (BNKFe)",
            "polar-13 (13 inputs)",
            "activation  GELU\n",
            "ln sigma azimuth, rad",
            "\ny, m ",
            "\nnetwork 2\n",
        ] {
            assert!(text.contains(part), "{part} is missing in:\n{text}");
        }
        let weights: usize = text
            .lines()
            .filter(|line| line.contains(" to "))
            .map(|line| {
                line.split_whitespace()
                    .nth(3)
                    .unwrap()
                    .parse::<usize>()
                    .unwrap()
            })
            .sum();
        let zeros: usize = text
            .lines()
            .filter(|line| line.matches('x').count() == 1 && line.starts_with("    "))
            .filter_map(|line| line.split_whitespace().last()?.parse::<usize>().ok())
            .sum();
        let total: usize = text
            .lines()
            .find_map(|line| line.strip_prefix("sigma of ")?.strip_suffix(" weights"))
            .unwrap()
            .parse()
            .unwrap();
        assert_eq!(weights + zeros, total);
    }

    /// Each by its name and as it is, however small.
    #[test]
    fn parameters_are_named_and_read_back() {
        let blobs: [&[u8]; 2] = [
            include_bytes!("../../../models/bnkf.bnkf"),
            include_bytes!("../../../models/recursive.bnkf"),
        ];
        let firsts = ["speed sigma [m/s]", "mean range [m]"];
        for (bytes, first) in blobs.into_iter().zip(firsts) {
            let blob = Blob::parse(bytes).unwrap();
            let text = describe(bytes, &blob);
            let mut lines = text
                .lines()
                .skip_while(|line| !line.starts_with("parameter "));
            lines.next();
            let shown: Vec<(&str, f32)> = lines
                .take_while(|line| !line.is_empty())
                .map(|line| line.rsplit_once(' ').unwrap())
                .map(|(name, value)| (name.trim_end(), value.parse().unwrap()))
                .collect();
            let names = blob.kind().parameter_limits().iter().map(|l| l.name);
            let expected: Vec<_> = names.zip(blob.parameters().iter()).collect();
            assert_eq!(shown[0].0, first);
            assert_eq!(shown, expected);
            assert!(shown.iter().all(|(name, _)| name.len() < PARAMETER));
        }
    }
}
