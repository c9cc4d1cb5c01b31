//! Corrections under several hypotheses, merged by their moments.

use super::correction::GATE_NIS;
use super::hypotheses::{HYPOTHESES, NOMINAL, OUTLIER};
use super::state::{Covariance, State};
use crate::ekf::Corrected;
use crate::estimate::Doubt;
use crate::scalar::Scalar;

/// Difference of log-likelihoods beyond which two hypotheses differ no more.
const LN_ODDS_MAX: f64 = 60.0;

/// Probability of being wrong from which a measurement that is used counts as one that is not.
pub const SUSPECT: f32 = 0.5;
/// Gate of such a measurement. It fits the hypothesis that it is wrong badly as well: chance (chi-square, four degrees)
/// would pass 20 once in 2,000, while what is another target's or nobody's may be anywhere.
pub const SUSPECT_GATE_NIS: f32 = 20.0;

/// How steeply a hypothesis comes to count with what a measurement says for it: one that makes it twice as
/// likely counts for all but a sixteenth.
const EVIDENCE_POWER: f64 = 4.0;
/// The least that a hypothesis counts for; its logarithm stays a number.
const EVIDENCE_MIN: f64 = 1e-30;

/// Corrections under several hypotheses, merged.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<S> {
    /// Mean and covariance of all, and the mean of their NIS, which the gate asks.
    pub corrected: Corrected<S, 9>,
    /// Posterior probability of each hypothesis.
    pub shares: [S; HYPOTHESES],
    /// Log-likelihood of the measurement under those so far, up to a constant of the sensor.
    ln_likelihood: S,
    /// Log-likelihood under the first one alone.
    ln_own: S,
}

impl<S: Scalar> Mixture<S> {
    /// Room for one.
    #[inline]
    pub fn new() -> Self {
        let zero = S::constant(0.0);
        Self {
            corrected: Corrected {
                state: [zero; 9],
                covariance: [[zero; 9]; 9],
                nis: zero,
                ln_root: zero,
            },
            shares: [zero; HYPOTHESES],
            ln_likelihood: zero,
            ln_own: zero,
        }
    }

    /// A state that no hypothesis corrected yet.
    pub fn before(state: &State<S>, covariance: &Covariance<S>) -> Self {
        let mut mixture = Self::new();
        mixture.corrected.begin(state, covariance);
        mixture
    }

    /// Says which hypothesis, alone, `corrected` is the correction under.
    pub fn begin(&mut self, number: usize, odds: S) {
        self.shares = [S::constant(0.0); HYPOTHESES];
        self.shares[number] = S::constant(1.0);
        self.ln_own = ln_likelihood(&self.corrected);
        self.ln_likelihood = odds.ln() + self.ln_own;
    }

    /// Part of a hypothesis that counts, for what it explains better than the first one does, `b` times: `1 - b^-4`,
    /// none where it explains nothing better. What no measurement can tell is in the first one's noise
    /// already, which was fitted alone; a manoeuvre's noise would be added to it at every step.
    pub fn evidence(&self, other: &Corrected<S, 9>) -> S {
        let zero = S::constant(0.0);
        let better = (ln_likelihood(other) - self.ln_own).max(zero);
        let left = (zero - S::constant(EVIDENCE_POWER) * better).exp();
        (S::constant(1.0) - left).max(S::constant(EVIDENCE_MIN))
    }

    /// Joins another hypothesis. Merging by moments does not depend on the order.
    pub fn join(&mut self, number: usize, odds: S, other: &Corrected<S, 9>) {
        let one = S::constant(1.0);
        let apart = odds.ln() + ln_likelihood(other) - self.ln_likelihood;
        let apart = apart.clamp(-LN_ODDS_MAX, LN_ODDS_MAX);
        let share = one / (one + (-apart).exp());
        let left = one - share;
        self.ln_likelihood = self.ln_likelihood + apart.softplus();
        for kept in &mut self.shares {
            *kept = *kept * left;
        }
        self.shares[number] = share;
        let own = &mut self.corrected;
        own.nis = own.nis + share * (other.nis - own.nis);
        let away: [S; 9] = core::array::from_fn(|i| other.state[i] - own.state[i]);
        let spread = away.map(|away| left * share * away);
        for i in 0..9 {
            own.state[i] = own.state[i] + share * away[i];
            for j in 0..=i {
                let between = share * (other.covariance[i][j] - own.covariance[i][j]);
                let value = own.covariance[i][j] + between + spread[i] * away[j];
                own.covariance[i][j] = value;
                own.covariance[j][i] = value;
            }
        }
    }
}

impl<S: Scalar> Default for Mixture<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl Mixture<f32> {
    /// Whether the measurement is used.
    pub fn passes_gate(&self) -> bool {
        let gate = if self.shares[OUTLIER] < SUSPECT {
            GATE_NIS as f32
        } else {
            SUSPECT_GATE_NIS
        };
        self.corrected.nis < gate
    }

    /// What an estimate says of the hypotheses.
    pub fn doubt(&self) -> Doubt {
        Doubt {
            manoeuvre: self.shares[NOMINAL + 1..OUTLIER].iter().sum(),
            outlier: self.shares[OUTLIER],
        }
    }
}

fn ln_likelihood<S: Scalar>(corrected: &Corrected<S, 9>) -> S {
    S::constant(-0.5) * corrected.nis - corrected.ln_root
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::state::tests::covariance;

    fn corrected(seed: u64) -> Corrected<f64, 9> {
        let wave = |i: usize| (seed as f64 + 1.3 * i as f64).sin();
        Corrected {
            state: core::array::from_fn(wave),
            covariance: covariance(3 + seed),
            nis: 3.0 + 2.0 * seed as f64,
            ln_root: 0.4 * seed as f64,
        }
    }

    /// One hypothesis alone.
    fn of(number: usize, odds: f64, corrected: Corrected<f64, 9>) -> Mixture<f64> {
        let mut mixture = Mixture::before(&corrected.state, &corrected.covariance);
        mixture.corrected = corrected;
        mixture.begin(number, odds);
        mixture
    }

    /// The definition: weights by likelihood, mean, covariance within and between.
    #[test]
    fn the_merged_moments_are_those_of_the_mixture() {
        let odds = [0.5, 0.3, 0.15, 0.05];
        let parts: [_; HYPOTHESES] = core::array::from_fn(|k| corrected(k as u64));
        let mut mixture = of(0, odds[0], parts[0]);
        for k in 1..HYPOTHESES {
            mixture.join(k, odds[k], &parts[k]);
        }
        let raw: [f64; HYPOTHESES] =
            core::array::from_fn(|k| odds[k] * (-0.5 * parts[k].nis - parts[k].ln_root).exp());
        let total: f64 = raw.iter().sum();
        let share = raw.map(|w| w / total);
        for k in 0..HYPOTHESES {
            assert!((mixture.shares[k] - share[k]).abs() < 1e-12);
        }
        assert!((mixture.ln_likelihood - total.ln()).abs() < 1e-12);
        let mean: [f64; 9] =
            core::array::from_fn(|i| (0..HYPOTHESES).map(|k| share[k] * parts[k].state[i]).sum());
        for i in 0..9 {
            assert!((mixture.corrected.state[i] - mean[i]).abs() < 1e-12);
            for j in 0..9 {
                let expected: f64 = (0..HYPOTHESES)
                    .map(|k| {
                        let away = |i: usize| parts[k].state[i] - mean[i];
                        share[k] * (parts[k].covariance[i][j] + away(i) * away(j))
                    })
                    .sum();
                assert!((mixture.corrected.covariance[i][j] - expected).abs() < 1e-12);
            }
        }
        let nis: f64 = (0..HYPOTHESES).map(|k| share[k] * parts[k].nis).sum();
        assert!((mixture.corrected.nis - nis).abs() < 1e-12);
    }

    /// A measurement that is likelier wrong than not must fit the hypothesis that it is.
    #[test]
    fn the_gate_of_a_suspect_is_tighter() {
        let passes = |outlier: f32, nis: f32| {
            let mut mixture: Mixture<f32> = Mixture::new();
            mixture.shares[OUTLIER] = outlier;
            mixture.corrected.nis = nis;
            mixture.passes_gate()
        };
        assert!(passes(0.49, 63.9) && !passes(0.49, 64.0));
        assert!(passes(0.5, 19.9) && !passes(0.5, 20.0));
        assert!(!passes(0.0, f32::NAN));
    }

    #[test]
    fn an_impossible_hypothesis_counts_for_nothing() {
        let mut impossible = corrected(1);
        impossible.nis = 1e8;
        let mut mixture = of(0, 0.99, corrected(0));
        mixture.join(1, 0.01, &impossible);
        assert!(mixture.shares[1] < 1e-25);
        for i in 0..9 {
            assert!((mixture.corrected.state[i] - corrected(0).state[i]).abs() < 1e-20);
        }
    }

    /// Half as likely, as likely, 1.1, 2 and 1e9 times as likely as the first one.
    #[test]
    fn a_hypothesis_counts_for_what_it_explains_better() {
        let mixture = of(0, 0.99, corrected(0));
        for (times, expected) in [
            (0.5_f64, 0.0),
            (1.0, 0.0),
            (1.1, 1.0 - 1.1_f64.powi(-4)),
            (2.0, 0.9375),
            (1e9, 1.0),
        ] {
            let mut other = corrected(0);
            other.nis -= 2.0 * times.ln();
            assert!(
                (mixture.evidence(&other) - expected).abs() < 1e-12,
                "{times}"
            );
        }
        let mut hopeless = corrected(0);
        hopeless.nis = 1e9;
        assert!(mixture.evidence(&hopeless) > 0.0);
    }

    /// Every hypothesis between the network's own and the outlier is a manoeuvre.
    #[test]
    fn doubt_is_what_the_shares_say() {
        let part = corrected(0);
        let single = Corrected {
            state: part.state.map(|x| x as f32),
            covariance: part.covariance.map(|row| row.map(|x| x as f32)),
            nis: 0.0,
            ln_root: 0.0,
        };
        let mut mixture = Mixture::before(&single.state, &single.covariance);
        mixture.shares = [0.4, 0.25, 0.125, 0.225];
        let doubt = mixture.doubt();
        assert_eq!((doubt.manoeuvre, doubt.outlier), (0.375, 0.225));
    }
}
