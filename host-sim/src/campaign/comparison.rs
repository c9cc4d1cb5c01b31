//! Every method against every other on the same steps.

use serde::Serialize;

use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::FlightSum;
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

/// All pairs of methods, by the errors (m) of every cluster, which are the same flights for every method.
pub fn comparisons(
    condition: Condition,
    errors_m: &[(Method, &[FlightSum])],
    seed: u64,
) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for (index, (a, first)) in errors_m.iter().enumerate() {
        for (b, second) in &errors_m[index + 1..] {
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
