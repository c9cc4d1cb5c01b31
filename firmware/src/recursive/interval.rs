//! One prediction as the step after it must know it: what may be added to its noise, and the
//! correction under every hypothesis about that.

use super::correction::correct;
use super::densities::Densities;
use super::hypotheses::{HYPOTHESES, Hypotheses, Manoeuvre, NOMINAL, OUTLIER};
use super::mixture::Mixture;
use super::motion::add_noise;
use super::sight::LineOfSight;
use super::state::{Covariance, State};
use crate::ekf::Corrected;
use crate::measurement::Vectors;
use crate::scalar::Scalar;

/// Shorter steps count as one of this length where steps of a gap are counted, s, and a manoeuvre may have begun this
/// long ago whatever came since: nobody has seen it yet, and another sensor's reading just before, or at the same time, may
/// have been too blunt to.
const STEP_MIN_S: f64 = 0.05;

/// What a correction needs to know of the prediction before it.
#[derive(Clone, Copy, Debug)]
pub struct Interval<S> {
    /// The line of sight that the noise runs along.
    pub sight: LineOfSight<S>,
    /// The network's process noise.
    pub noise: Densities<S>,
    /// What the sensor's stated variances are multiplied with: angles, range, range-rate.
    pub sensor_scale: [S; 3],
    /// Length, s.
    pub dt_s: S,
    /// Time from the last measurement to the interval's beginning, s: a manoeuvre may have begun at any time
    /// of it, seen by nobody.
    pub coast_s: S,
}

impl<S: Scalar> Interval<S> {
    /// Adds what is expected beyond the network's noise, for a step without a measurement.
    // Its densities would weigh on the stack of the network.
    #[inline(never)]
    pub fn doubt(
        &self,
        covariance: &mut Covariance<S>,
        hypotheses: &Hypotheses<S>,
        odds: &[S; HYPOTHESES],
    ) {
        let extra = hypotheses.expected(odds, &self.noise);
        add_noise(covariance, &self.sight, &extra, self.dt_s);
    }

    /// Steps of this length that a manoeuvre may have been at work in: this one and those of the gap before.
    fn steps(&self) -> S {
        S::constant(1.0) + self.coast_s / self.dt_s.max(S::constant(STEP_MIN_S))
    }

    /// Adds what a manoeuvre has beyond the network's noise, over all the time since the last measurement. One of a
    /// single step, at any of `n`, has an n-th of the density over all of them in the mean, one that goes on
    /// has all of it; the root is between. The bound of what it adds is not divided.
    // Its densities would weigh on the stack of the correction.
    #[inline(never)]
    fn widen(&self, covariance: &mut Covariance<S>, manoeuvre: &Manoeuvre<S>) {
        let time_s = (self.coast_s + self.dt_s).max(S::constant(STEP_MIN_S));
        let part = S::constant(1.0) / self.steps().sqrt();
        let extra = manoeuvre.extra(&self.noise.scaled(part, part, part));
        add_noise(covariance, &self.sight, &extra, time_s);
    }

    /// Corrects a predicted state under every hypothesis and merges what comes of it in `mixture`, which
    /// is [`Mixture::before`] of the state. Returns the innovations whitened as the network expects
    /// them. Nothing is checked.
    pub fn weigh(
        &self,
        state: &State<S>,
        covariance: &Covariance<S>,
        vectors: &Vectors<S>,
        hypotheses: &Hypotheses<S>,
        odds: &[S; HYPOTHESES],
        mixture: &mut Mixture<S>,
    ) -> [S; 4] {
        let whitened = correct(&mut mixture.corrected, vectors, self.sensor_scale);
        mixture.begin(NOMINAL, odds[NOMINAL]);
        // One place for all of them: each would weigh on the stack.
        let mut part = Corrected::new();
        for (number, manoeuvre) in (NOMINAL + 1..).zip(&hypotheses.manoeuvres) {
            part.begin(state, covariance);
            self.widen(&mut part.covariance, manoeuvre);
            correct(&mut part, vectors, self.sensor_scale);
            let counts = mixture.evidence(&part);
            mixture.join(number, odds[number] * counts, &part);
        }
        let blunt = |scale| scale * hypotheses.outlier_variance;
        let scale = self.sensor_scale.map(blunt);
        part.begin(state, covariance);
        correct(&mut part, vectors, scale);
        mixture.join(OUTLIER, odds[OUTLIER], &part);
        whitened
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::state::tests::covariance as spread;

    const STATE: State<f64> = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4, 0.3, 0.2, -0.1];

    const SIGMAS: [f64; 4] = [0.05, 0.04, 2.0, 0.3];
    const ODDS: [f64; HYPOTHESES] = [0.4, 0.3, 0.2, 0.1];

    fn covariance() -> Covariance<f64> {
        spread(4)
    }

    /// What a measurement makes of the state over an interval, and its whitened innovations.
    fn weighed(interval: &Interval<f64>, measured: [f64; 4]) -> (Mixture<f64>, [f64; 4]) {
        let (state, covariance) = (&STATE, &covariance());
        let vectors = Vectors::whole(measured, SIGMAS);
        let mut mixture = Mixture::before(state, covariance);
        let hypotheses = &Hypotheses::DRONE;
        let whitened = interval.weigh(state, covariance, &vectors, hypotheses, &ODDS, &mut mixture);
        (mixture, whitened)
    }

    fn expected() -> [f64; 4] {
        crate::radar::predict([12.0, -21.0, 9.0], [1.5, -0.7, 0.4]).measurement
    }

    /// An interval of a fifth of a second that begins `coast_s` after the last measurement.
    fn interval(coast_s: f64) -> Interval<f64> {
        Interval {
            sight: LineOfSight::to([STATE[0], STATE[1], STATE[2]]),
            noise: Densities {
                jerk: [1.0, 2.0, 3.0],
                acceleration: [0.1, 0.2, 0.3],
                velocity: 0.01,
            },
            sensor_scale: [1.5, 0.5, 3.0],
            dt_s: 0.2,
            coast_s,
        }
    }

    /// Every hypothesis by itself: its own process noise, the outlier's own sensor.
    #[test]
    fn weighing_corrects_under_every_hypothesis() {
        assert_weighed(0.0, 1.0);
    }

    /// A measurement as expected says nothing for a manoeuvre, whose noise would widen what is known.
    #[test]
    fn a_manoeuvre_that_explains_nothing_better_counts_for_nothing() {
        let [_, burst, jump, outlier] = weighed(&interval(0.0), expected()).0.shares;
        assert!(burst < 1e-20 && jump < 1e-20, "{burst} {jump}");
        assert!(outlier > 1e-6, "an outlier is a matter of odds: {outlier}");
    }

    /// After three more steps it may have been at work in all four, at half the density.
    #[test]
    fn a_manoeuvre_may_have_been_in_the_gap() {
        assert_weighed(0.6, 4.0);
    }

    /// At the time of another reading, which may have been too blunt to see it.
    #[test]
    fn a_manoeuvre_may_have_begun_just_before() {
        let at_once = Interval {
            dt_s: 0.0,
            ..interval(0.0)
        };
        let soon = Interval {
            dt_s: STEP_MIN_S,
            ..interval(0.0)
        };
        let mut measured = expected();
        measured[3] += 8.0;
        let shares = weighed(&at_once, measured).0.shares;
        assert_eq!(shares, weighed(&soon, measured).0.shares);
        assert!(
            shares[2] > 0.2,
            "a jump is likelier than before: {shares:?}"
        );
    }

    #[test]
    fn steps_of_a_gap_are_counted() {
        for (dt_s, coast_s, steps) in [
            (0.0, 0.0, 1.0),
            (0.02, 0.0, 1.0),
            (0.02, 0.3, 7.0),
            (0.25, 0.0, 1.0),
            (0.25, 0.75, 4.0),
        ] {
            let interval = Interval {
                dt_s,
                ..interval(coast_s)
            };
            let got = interval.steps();
            assert!((got - steps).abs() < 1e-12, "{dt_s} {coast_s}: {got}");
        }
    }

    fn assert_weighed(coast_s: f64, steps: f64) {
        let interval = interval(coast_s);
        let hypotheses = Hypotheses::DRONE;
        let mut measured = expected();
        measured[2] += 12.0;
        let vectors = Vectors::whole(measured, SIGMAS);
        let odds = ODDS;
        let (got, whitened) = weighed(&interval, measured);
        let widened = |k: usize, time_s: f64, steps: f64| {
            let mut wider = covariance();
            if let Some(manoeuvre) = hypotheses.manoeuvres.get(k.wrapping_sub(1)) {
                let part = steps.sqrt().recip();
                let unseen = interval.noise.scaled(part, part, part);
                let noise = manoeuvre.extra(&unseen);
                add_noise(&mut wider, &interval.sight, &noise, time_s);
            }
            wider
        };
        let outlier = [1.5, 0.5, 3.0].map(|scale| scale * hypotheses.outlier_variance);
        let scales = [[1.5, 0.5, 3.0], [1.5, 0.5, 3.0], [1.5, 0.5, 3.0], outlier];
        let parts: [_; HYPOTHESES] = core::array::from_fn(|k| {
            let mut part = Corrected::before(&STATE, &widened(k, coast_s + 0.2, steps));
            let whitened = correct(&mut part, &vectors, scales[k]);
            (part, whitened)
        });
        let likelihood = |k: usize| (-0.5 * parts[k].0.nis - parts[k].0.ln_root).exp();
        let raw: [f64; HYPOTHESES] = core::array::from_fn(|k| {
            let worse = likelihood(NOMINAL) / likelihood(k);
            let is_manoeuvre = k != NOMINAL && k != OUTLIER;
            let counts = if is_manoeuvre {
                1.0 - worse.powi(4)
            } else {
                1.0
            };
            odds[k] * likelihood(k) * counts.max(0.0)
        });
        let total: f64 = raw.iter().sum();
        assert_eq!(whitened, parts[NOMINAL].1);
        for k in 0..HYPOTHESES {
            assert!((got.shares[k] - raw[k] / total).abs() < 1e-12, "{k}");
            assert!(got.shares[k] > 1e-6, "{k}: each counts");
        }
        for i in 0..9 {
            let mean: f64 = (0..HYPOTHESES)
                .map(|k| got.shares[k] * parts[k].0.state[i])
                .sum();
            assert!((got.corrected.state[i] - mean).abs() < 1e-9, "{i}");
        }
        // A gap expects the mean of all.
        let mut doubted = covariance();
        interval.doubt(&mut doubted, &hypotheses, &odds);
        let spread = odds[1] * (widened(1, 0.2, 1.0)[0][0] - covariance()[0][0])
            + odds[2] * (widened(2, 0.2, 1.0)[0][0] - covariance()[0][0]);
        assert!((doubted[0][0] - covariance()[0][0] - spread).abs() < 1e-12);
    }
}
