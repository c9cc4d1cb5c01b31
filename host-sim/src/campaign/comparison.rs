//! Every method against every other on the same steps.

use serde::Serialize;

use super::cell_summary::{Track, error_sums};
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::paired::PairedDifference;

/// The paired difference of two methods under one condition.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Comparison {
    /// First method.
    pub a: Method,
    /// Second method.
    pub b: Method,
    /// The condition.
    #[serde(flatten)]
    pub condition: Condition,
    /// Difference of the ED, `a - b`, metres: negative if `a` is better.
    #[serde(flatten)]
    pub ed_m: PairedDifference,
}

/// All pairs of `tracks`, which hold the same flights for every method.
pub fn comparisons(
    condition: Condition,
    tracks: &[(Method, Vec<Track<'_>>)],
    seed: u64,
) -> Vec<Comparison> {
    let sums: Vec<_> = tracks
        .iter()
        .map(|(method, tracks)| (*method, error_sums(tracks)))
        .collect();
    let mut comparisons = Vec::new();
    for (index, (a, first)) in sums.iter().enumerate() {
        for (b, second) in &sums[index + 1..] {
            let ed_m = PairedDifference::new(first, second, seed);
            comparisons.push(Comparison {
                a: *a,
                b: *b,
                condition,
                ed_m,
            });
        }
    }
    comparisons
}
