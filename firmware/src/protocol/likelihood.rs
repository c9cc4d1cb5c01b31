//! Likelihoods on the wire.

use serde::{Deserialize, Serialize};

use crate::Likelihood;

/// A [`Likelihood`] on the wire, same units and order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LikelihoodFrame {
    /// Elevation, azimuth, range, range-rate.
    pub innovation: [Option<f32>; 4],
    /// Normalised innovation squared.
    pub nis: f32,
    /// Its degrees of freedom.
    pub degrees: u8,
    /// Natural logarithm of the density.
    pub ln_likelihood: f32,
    /// Whether the gate would pass the measurement.
    pub passes_gate: bool,
    /// Ticks spent inside the tracker, see [`EstimateFrame`](crate::protocol::EstimateFrame).
    pub ticks: u32,
}

impl LikelihoodFrame {
    /// A likelihood and what it cost.
    pub fn new(likelihood: &Likelihood, ticks: u32) -> Self {
        Self {
            innovation: likelihood.innovation,
            nis: likelihood.nis,
            degrees: likelihood.degrees,
            ln_likelihood: likelihood.ln_likelihood,
            passes_gate: likelihood.passes_gate,
            ticks,
        }
    }

    /// Whether two are the same to the last bit, whatever they cost.
    pub fn same_bits(&self, other: &Self) -> bool {
        let bits = |f: &Self| {
            (
                f.innovation.map(|y| y.map(f32::to_bits)),
                [f.nis, f.ln_likelihood].map(f32::to_bits),
                (f.degrees, f.passes_gate),
            )
        };
        bits(self) == bits(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_bits_sees_every_number_but_not_the_cost() {
        let likelihood = Likelihood {
            innovation: [Some(1.0), None, Some(2.0), Some(0.0)],
            nis: 3.0,
            degrees: 3,
            ln_likelihood: -4.0,
            passes_gate: true,
        };
        let base = LikelihoodFrame::new(&likelihood, 1);
        assert!(base.same_bits(&LikelihoodFrame::new(&likelihood, 2)));
        let changes: [fn(&mut Likelihood); 6] = [
            |l| l.innovation[3] = Some(-0.0),
            |l| l.innovation[1] = Some(0.0),
            |l| l.nis = 3.5,
            |l| l.degrees = 4,
            |l| l.ln_likelihood = 4.0,
            |l| l.passes_gate = false,
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let mut other = likelihood;
            change(&mut other);
            assert!(
                !base.same_bits(&LikelihoodFrame::new(&other, 1)),
                "{number}"
            );
        }
    }
}
