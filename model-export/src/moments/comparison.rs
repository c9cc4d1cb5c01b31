//! The firmware's moments without passes beside those of many passes.

use super::inputs::Level;
use super::reference::{MeanAndCovariance, decoded, sampled};
use crate::posterior::architecture::ArchitectureError;
use bnkf::blob::{Blob, Kind, NetworkView};
use bnkf::network::repeats::Repeats;
use bnkf::network::{Network, Scratch, moments};
use bnkf::recursive::schedule::{JERK_OUTPUT, OUTPUTS};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Largest accepted error of the covariance in the median, as a share of its Frobenius norm.
pub const COVARIANCE_MEDIAN_MAX: f64 = 0.05;
/// Largest accepted 95th percentile of the same.
pub const COVARIANCE_P95_MAX: f64 = 0.15;
/// Largest accepted median distance of the mean, in predictive standard deviations.
pub const MEAN_MEDIAN_MAX: f64 = 0.02;

/// One network of one blob under one noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct References {
    /// Index of the network in its blob.
    pub network: usize,
    /// The noise.
    pub level: String,
    /// Passes of each.
    pub passes: u32,
    /// Normalised inputs, and what the passes say of the outputs that [`judged`] names.
    pub cases: Vec<(Vec<f32>, MeanAndCovariance)>,
}

/// How far the firmware's moments are from the references.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Inputs.
    pub count: usize,
    /// Median, 95th percentile and largest error of the covariance, as a share of its norm.
    pub covariance: [f64; 3],
    /// The same of the mean, root mean square over outputs, in predictive standard deviations.
    pub mean: [f64; 3],
}

/// The outputs whose moments the tracker uses: all of a memoryless blob, the mean jerk of a
/// recursive one.
#[must_use]
pub fn judged(blob: &Blob<'_>, view: NetworkView<'_>) -> Range<usize> {
    match blob.kind() {
        Kind::Memoryless => 0..Network::new(view).outputs(),
        Kind::Recursive => JERK_OUTPUT..JERK_OUTPUT + 3,
    }
}

/// Runs the passes of every network of `blob` for every level.
///
/// # Errors
/// The blob holds no network; a checked one does.
pub fn references(
    blob: &Blob<'_>,
    levels: &[Level],
    passes: u32,
    seed: u64,
) -> Result<Vec<References>, ArchitectureError> {
    let mut all = Vec::new();
    for (network, view) in blob.networks().enumerate() {
        let weights = decoded(view)?;
        for level in levels {
            let found = sampled(&weights, &level.inputs, &judged(blob, view), passes, seed);
            all.push(References {
                network,
                level: level.name.clone(),
                passes,
                cases: level.inputs.iter().cloned().zip(found).collect(),
            });
        }
    }
    Ok(all)
}

impl Errors {
    /// Of the firmware's moments; `None` if there are no cases, or they are not of a network of `blob`.
    #[must_use]
    pub fn of(blob: &Blob<'_>, references: &References) -> Option<Self> {
        let view = blob.networks().nth(references.network)?;
        let judged = judged(blob, view);
        let network = Network::new(view);
        let (inputs, outputs) = (network.inputs(), judged.len());
        let fits = |(x, found): &(Vec<f32>, MeanAndCovariance)| {
            let rows = &found.covariance;
            x.len() == inputs
                && (found.mean.len(), rows.len()) == (outputs, outputs)
                && rows.iter().all(|row| row.len() == outputs)
        };
        if !references.cases.iter().all(fits) {
            return None;
        }
        let repeats = match blob.kind() {
            Kind::Memoryless => Repeats::of(&network),
            Kind::Recursive => Repeats::NONE,
        };
        let apart = references.cases.iter().map(|(inputs, reference)| {
            let got = firmware(&network, &repeats, inputs, &judged);
            distance(&got, reference)
        });
        let (covariance, mean): (Vec<f64>, Vec<f64>) = apart.unzip();
        (!mean.is_empty()).then(|| Self {
            count: mean.len(),
            covariance: spread(covariance),
            mean: spread(mean),
        })
    }

    /// Whether they stay within the limits.
    #[must_use]
    pub fn accepted(&self) -> bool {
        self.covariance[0] <= COVARIANCE_MEDIAN_MAX
            && self.covariance[1] <= COVARIANCE_P95_MAX
            && self.mean[0] <= MEAN_MEDIAN_MAX
    }
}

/// What the firmware says of `judged`, one or three outputs.
fn firmware(
    network: &Network<'_>,
    repeats: &Repeats,
    inputs: &[f32],
    judged: &Range<usize>,
) -> MeanAndCovariance {
    let mut mean = [0.0_f32; OUTPUTS];
    let (slots, first) = (&mut mean[..network.outputs()], judged.start);
    let mut scratch = Scratch::new();
    let covariance: Vec<Vec<f64>> = if judged.len() == 1 {
        wide(moments::outputs::<1>(
            network,
            repeats,
            inputs,
            slots,
            first,
            &mut scratch,
        ))
    } else {
        wide(moments::outputs::<3>(
            network,
            repeats,
            inputs,
            slots,
            first,
            &mut scratch,
        ))
    };
    MeanAndCovariance {
        mean: mean[judged.clone()].iter().map(|&x| f64::from(x)).collect(),
        covariance,
    }
}

fn wide<const N: usize>(covariance: [[f32; N]; N]) -> Vec<Vec<f64>> {
    covariance.map(|row| row.map(f64::from).to_vec()).to_vec()
}

fn distance(got: &MeanAndCovariance, reference: &MeanAndCovariance) -> (f64, f64) {
    let square = |a: f64, b: f64| (a - b) * (a - b);
    let entries = || {
        got.covariance
            .iter()
            .flatten()
            .zip(reference.covariance.iter().flatten())
    };
    let apart: f64 = entries().map(|(&a, &b)| square(a, b)).sum();
    let size: f64 = entries().map(|(_, b)| b * b).sum();
    let means = got.mean.iter().zip(&reference.mean).enumerate();
    let shifts = means.map(|(i, (&a, &b))| square(a, b) / reference.covariance[i][i]);
    let shift = shifts.sum::<f64>() / got.mean.len() as f64;
    ((apart / size).sqrt(), shift.sqrt())
}

fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [0.5, 0.95, 1.0].map(|part| values[(part * (values.len() - 1) as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_shares_and_deviations() {
        let of = |mean: f64, variance: f64| MeanAndCovariance {
            mean: vec![mean, 0.0],
            covariance: vec![vec![variance, 0.0], vec![0.0, 4.0]],
        };
        let (covariance, mean) = distance(&of(1.0, 3.5), &of(1.5, 3.0));
        assert!((covariance - 0.1).abs() < 1e-12, "{covariance}");
        assert!(
            (mean - (0.25_f64 / 3.0 / 2.0).sqrt()).abs() < 1e-12,
            "{mean}"
        );
        assert_eq!(spread(vec![3.0, 1.0, 2.0]), [2.0, 3.0, 3.0]);
    }
}
