//! How a target may differ from what the network expects of it, and how much of that is believed.
//!
//! The network's noise densities are right for most steps of most targets. Now and then a target
//! bursts or jumps, or a reading is wrong: latent biases of the densities and of the sensor's
//! variance, drawn anew at every step from a prior with heavy tails, of which the blob holds a few
//! values and their probabilities. Every measurement is tried under each; the posterior is exact
//! given the Gaussian before, and the Gaussians after are merged by their moments (first-order
//! generalised pseudo-Bayes; Bar-Shalom, Li and Kirubarajan 2001, section 11.6.4). How often each
//! occurs is learned for each target: a Dirichlet prior, updated by soft counts.

use super::densities::Densities;
use crate::ekf::Corrected;
use crate::estimate::Doubt;
use crate::scalar::Scalar;

/// Hypotheses, the network's own first.
pub const HYPOTHESES: usize = 4;
/// The one under which the network is right.
pub const NOMINAL: usize = 0;
/// The one under which the reading is wrong; the ones between are manoeuvres.
pub const OUTLIER: usize = HYPOTHESES - 1;
/// Probability of a wrong reading from which a rejected one says nothing of the target. Below it the
/// network sees it: a manoeuvre that nobody expected begins like a wrong reading.
pub const OFTEN_WRONG: f64 = 0.05;
/// Difference of log-likelihoods beyond which two hypotheses differ no more.
const LN_ODDS_MAX: f64 = 60.0;

/// Manoeuvres that the network did not expect.
const MANOEUVRES: usize = HYPOTHESES - 2;

/// What a step's process noise is multiplied with, and how often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manoeuvre<S> {
    /// Prior probability.
    pub prior: S,
    /// Multiplies the densities of white jerk.
    pub jerk: S,
    /// Multiplies the densities of white acceleration.
    pub acceleration: S,
    /// Multiplies the density of white velocity.
    pub velocity: S,
}

/// All hypotheses; the rest of the probability is the network's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypotheses<S> {
    /// Steps that the prior counts for when frequencies are learned.
    pub confidence: S,
    /// A burst, and a jump.
    pub manoeuvres: [Manoeuvre<S>; MANOEUVRES],
    /// Prior probability of a wrong reading.
    pub outlier: S,
    /// What the sensor's variances are multiplied with if the reading is wrong.
    pub outlier_variance: S,
}

impl Hypotheses<f64> {
    /// Those of small drones. Multipliers are powers of e.
    // To four digits, as the shipped blobs have them.
    #[expect(clippy::approx_constant)]
    pub const DRONE: Self = Self {
        confidence: 100.0,
        manoeuvres: [
            Manoeuvre {
                prior: 5e-3,
                jerk: 7.389,
                acceleration: 54.6,
                velocity: 2.718,
            },
            Manoeuvre {
                prior: 5e-4,
                jerk: 54.6,
                acceleration: 2981.0,
                velocity: 54.6,
            },
        ],
        outlier: 3e-3,
        outlier_variance: 403.4,
    };

    /// The same for another scalar.
    pub fn known<S: Scalar>(&self) -> Hypotheses<S> {
        let c = S::constant;
        Hypotheses {
            confidence: c(self.confidence),
            manoeuvres: self.manoeuvres.map(|m| Manoeuvre {
                prior: c(m.prior),
                jerk: c(m.jerk),
                acceleration: c(m.acceleration),
                velocity: c(m.velocity),
            }),
            outlier: c(self.outlier),
            outlier_variance: c(self.outlier_variance),
        }
    }
}

impl<S: Scalar> Hypotheses<S> {
    /// Probability of each before a measurement, for a target of which `counts` were seen.
    pub fn odds(&self, counts: &[S; HYPOTHESES]) -> [S; HYPOTHESES] {
        let [burst, jump] = self.manoeuvres.map(|m| m.prior);
        let nominal = S::constant(1.0) - burst - jump - self.outlier;
        let priors = [nominal, burst, jump, self.outlier];
        let seen = counts.iter().fold(self.confidence, |sum, &n| sum + n);
        core::array::from_fn(|k| (self.confidence * priors[k] + counts[k]) / seen)
    }

    /// Densities that a step without a measurement is expected to have beyond `nominal`.
    pub fn expected(&self, odds: &[S; HYPOTHESES], nominal: &Densities<S>) -> Densities<S> {
        let one = S::constant(1.0);
        let mut beyond = [S::constant(0.0); 3];
        for (m, &odds) in self.manoeuvres.iter().zip(&odds[NOMINAL + 1..]) {
            let more = [m.jerk, m.acceleration, m.velocity];
            for (sum, more) in beyond.iter_mut().zip(more) {
                *sum = *sum + odds * (more - one);
            }
        }
        let [jerk, acceleration, velocity] = beyond;
        nominal.scaled(jerk, acceleration, velocity)
    }
}

impl<S: Scalar> Manoeuvre<S> {
    /// Densities that a step of this manoeuvre has beyond `nominal`.
    pub fn extra(&self, nominal: &Densities<S>) -> Densities<S> {
        let one = S::constant(1.0);
        nominal.scaled(
            self.jerk - one,
            self.acceleration - one,
            self.velocity - one,
        )
    }
}

/// Corrections under several hypotheses, merged.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<S> {
    /// Mean and covariance of all, and the mean of their NIS, which the gate asks.
    pub corrected: Corrected<S, 9>,
    /// Posterior probability of each hypothesis.
    pub shares: [S; HYPOTHESES],
    /// Log-likelihood of the measurement under those so far, up to a constant of the sensor.
    ln_likelihood: S,
}

impl<S: Scalar> Mixture<S> {
    /// One hypothesis alone.
    pub fn of(number: usize, odds: S, corrected: Corrected<S, 9>) -> Self {
        let mut shares = [S::constant(0.0); HYPOTHESES];
        shares[number] = S::constant(1.0);
        Self {
            ln_likelihood: ln_likelihood(odds, &corrected),
            corrected,
            shares,
        }
    }

    /// Joins another hypothesis. Merging by moments does not depend on the order.
    pub fn join(&mut self, number: usize, odds: S, other: &Corrected<S, 9>) {
        let one = S::constant(1.0);
        let apart = ln_likelihood(odds, other) - self.ln_likelihood;
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

impl Mixture<f32> {
    /// What an estimate says of the hypotheses.
    pub fn doubt(&self) -> Doubt {
        Doubt {
            manoeuvre: self.shares[NOMINAL + 1..OUTLIER].iter().sum(),
            outlier: self.shares[OUTLIER],
        }
    }
}

fn ln_likelihood<S: Scalar>(odds: S, corrected: &Corrected<S, 9>) -> S {
    odds.ln() - S::constant(0.5) * corrected.nis - corrected.ln_root
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::state::tests::covariance;

    const H: Hypotheses<f64> = Hypotheses::DRONE;

    fn corrected(seed: u64) -> Corrected<f64, 9> {
        let wave = |i: usize| (seed as f64 + 1.3 * i as f64).sin();
        Corrected {
            state: core::array::from_fn(wave),
            covariance: covariance(3 + seed),
            nis: 3.0 + 2.0 * seed as f64,
            ln_root: 0.4 * seed as f64,
        }
    }

    #[test]
    fn odds_start_as_the_prior_and_follow_what_is_seen() {
        let odds = H.odds(&[0.0; HYPOTHESES]);
        for (k, expected) in [0.9915, 0.005, 0.0005, 0.003].into_iter().enumerate() {
            assert!((odds[k] - expected).abs() < 1e-12, "{k}");
        }
        let odds = H.odds(&[60.0, 40.0, 0.0, 0.0]);
        assert!((odds[1] - 40.5 / 200.0).abs() < 1e-12);
        assert!((odds.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_gap_expects_the_mean_of_all_densities() {
        let nominal = Densities {
            jerk: [1.0, 2.0, 3.0],
            acceleration: [0.1, 0.2, 0.3],
            velocity: 0.01,
        };
        let odds = [0.7, 0.15, 0.05, 0.1];
        let got = H.expected(&odds, &nominal);
        let mut mean = [0.0; 3];
        for (k, manoeuvre) in H.manoeuvres.iter().enumerate() {
            let extra = manoeuvre.extra(&nominal);
            mean[0] += odds[1 + k] * extra.jerk[1];
            mean[1] += odds[1 + k] * extra.acceleration[2];
            mean[2] += odds[1 + k] * extra.velocity;
        }
        assert!((got.jerk[1] - mean[0]).abs() < 1e-12);
        assert!((got.acceleration[2] - mean[1]).abs() < 1e-12);
        assert!((got.velocity - mean[2]).abs() < 1e-12);
        assert!(got.jerk[0] > 0.9);
    }

    /// The definition: weights by likelihood, mean, covariance within and between.
    #[test]
    fn the_merged_moments_are_those_of_the_mixture() {
        let odds = [0.5, 0.3, 0.15, 0.05];
        let parts: [_; HYPOTHESES] = core::array::from_fn(|k| corrected(k as u64));
        let mut mixture = Mixture::of(0, odds[0], parts[0]);
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

    #[test]
    fn an_impossible_hypothesis_counts_for_nothing() {
        let mut impossible = corrected(1);
        impossible.nis = 1e8;
        let mut mixture = Mixture::of(0, 0.99, corrected(0));
        mixture.join(1, 0.01, &impossible);
        assert!(mixture.shares[1] < 1e-25);
        for i in 0..9 {
            assert!((mixture.corrected.state[i] - corrected(0).state[i]).abs() < 1e-20);
        }
    }
}
