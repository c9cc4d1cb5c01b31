//! How a target may differ from what the network expects of it, and how much of that is believed.
//!
//! The network's noise densities are right for most steps of most targets. Now and then a target
//! bursts or jumps, or a reading is wrong: latent biases of the densities and of the sensor's
//! variance, drawn anew at every step from a prior with heavy tails, of which the blob holds a few
//! values and their probabilities. Every measurement is tried under each. A manoeuvre counts for what it
//! explains better than the network's own noise ([`Mixture::evidence`]); but for that the posterior is exact
//! given the Gaussian before, and the Gaussians after are merged by their moments (first-order generalised
//! pseudo-Bayes; Bar-Shalom, Li and Kirubarajan 2001, section 11.6.4). How often each occurs is learned for
//! each target: a Dirichlet prior, updated by soft counts.
//!
//! [`Mixture::evidence`]: super::mixture::Mixture::evidence

use super::densities::Densities;
use crate::scalar::Scalar;

/// Hypotheses, the network's own first.
pub const HYPOTHESES: usize = 4;
/// The one under which the network is right.
pub const NOMINAL: usize = 0;
/// The one under which the reading is wrong; the ones between are manoeuvres.
pub const OUTLIER: usize = HYPOTHESES - 1;
/// Share of wrong readings from which a rejected one says nothing of the target. Below it the
/// network sees it: a manoeuvre that nobody expected begins like a wrong reading.
const OFTEN_WRONG: f64 = 0.05;
/// Readings that the prior counts for there at least, however soon frequencies are learned otherwise: one or two
/// wrong readings are not often.
const OFTEN: f64 = 30.0;

/// Bound of the density of white acceleration that a manoeuvre adds along each axis, m^2/s^3; never reached. 17 m/s in a
/// tenth of a second, over all the time that nobody looked. Where a sensor is blunt the network's own noise is what it
/// cannot see, of which a manoeuvre is no multiple.
const ACCELERATION_DENSITY_MAX: f64 = 3e3;

/// Manoeuvres that the network did not expect.
const MANOEUVRES: usize = HYPOTHESES - 2;

/// What a step's process noise is multiplied with, and how often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manoeuvre<S> {
    /// Prior probability.
    pub prior: S,
    /// Multiplies the densities of white jerk.
    pub jerk: S,
    /// Multiplies the densities of white acceleration; what that adds stays below 3,000 m^2/s^3.
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
    /// Those that the model of the paper's volume is shipped with: jumps are more frequent as a track begins, a target's
    /// own frequencies are learned sooner, bursts are wider, and no manoeuvre moves a target at once.
    pub const PAPER: Self = {
        let [burst, jump] = Self::DRONE.manoeuvres;
        Self {
            confidence: 5.0,
            manoeuvres: [
                Manoeuvre {
                    acceleration: 100.0,
                    velocity: 1.0,
                    ..burst
                },
                Manoeuvre {
                    prior: 6e-3,
                    velocity: 1.0,
                    ..jump
                },
            ],
            ..Self::DRONE
        }
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

    /// How far the share of wrong readings, of a target of which `counts` were seen, stays below the one from which a
    /// rejected reading says nothing: positive where it says something.
    pub fn trust(&self, counts: &[S; HYPOTHESES]) -> S {
        let prior = self.confidence.max(S::constant(OFTEN));
        let seen = counts.iter().fold(prior, |sum, &n| sum + n);
        S::constant(OFTEN_WRONG) * seen - (prior * self.outlier + counts[OUTLIER])
    }

    /// Densities that a step without a measurement is expected to have beyond `nominal`.
    pub fn expected(&self, odds: &[S; HYPOTHESES], nominal: &Densities<S>) -> Densities<S> {
        let [burst, jump] = [0, 1].map(|k| {
            let odds = odds[NOMINAL + 1 + k];
            self.manoeuvres[k].extra(nominal).scaled(odds, odds, odds)
        });
        burst.plus(&jump)
    }
}

impl<S: Scalar> Manoeuvre<S> {
    /// Densities that a step of this manoeuvre has beyond `nominal`.
    pub fn extra(&self, nominal: &Densities<S>) -> Densities<S> {
        let one = S::constant(1.0);
        let most = S::constant(ACCELERATION_DENSITY_MAX);
        let beyond = self.acceleration - one;
        Densities {
            jerk: nominal.jerk.map(|own| own * (self.jerk - one)),
            acceleration: nominal.acceleration.map(|own| {
                let more = own * beyond;
                more / (one + more / most)
            }),
            velocity: nominal.velocity * (self.velocity - one),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: Hypotheses<f64> = Hypotheses::DRONE;

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

    /// One wrong reading as a track begins is not often, nor are three in thirty; two in a few and four in thirty are.
    #[test]
    fn one_wrong_reading_is_not_often() {
        let hypotheses = Hypotheses::PAPER;
        let trusts = |right: f64, wrong: f64| hypotheses.trust(&[right, 0.0, 0.0, wrong]) > 0.0;
        assert!(trusts(0.0, 0.0) && trusts(0.0, 1.0) && trusts(29.0, 3.0));
        assert!(!trusts(0.0, 2.0) && !trusts(5.0, 2.0) && !trusts(29.0, 4.0));
        // Frequencies that are learned later are trusted longer.
        assert!(H.trust(&[0.0, 0.0, 0.0, 4.0]) > 0.0 && H.trust(&[0.0, 0.0, 0.0, 6.0]) < 0.0);
    }

    /// Its multiple of what the network expects, as far as targets go.
    #[test]
    fn a_manoeuvre_is_no_more_than_a_target_can_do() {
        let [_, jump] = H.manoeuvres;
        let extra = |acceleration: f64| {
            let nominal = Densities {
                jerk: [2.0; 3],
                acceleration: [acceleration; 3],
                velocity: 0.1,
            };
            jump.extra(&nominal)
        };
        let sharp = extra(1e-5);
        assert!((sharp.acceleration[0] / 0.0298 - 1.0).abs() < 1e-4);
        assert!((sharp.jerk[1] - 2.0 * 53.6).abs() < 1e-12);
        assert!((sharp.velocity - 0.1 * 53.6).abs() < 1e-12);
        let even = extra(ACCELERATION_DENSITY_MAX / 2980.0);
        assert!((even.acceleration[1] / ACCELERATION_DENSITY_MAX - 0.5).abs() < 1e-12);
        let blunt = extra(1e6);
        assert!((blunt.acceleration[2] / ACCELERATION_DENSITY_MAX - 1.0).abs() < 1e-5);
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
}
