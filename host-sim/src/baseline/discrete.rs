//! A linear motion model over one time step.

use nalgebra::SMatrix;

use super::motion::Motion;

/// Transition and process noise of one step: `x' = F x + w`, w ~ N(0, Q).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete<const N: usize> {
    /// Length of the step, s.
    pub dt_s: f64,
    /// F.
    pub transition: SMatrix<f64, N, N>,
    /// Q, positive semi-definite.
    pub noise: SMatrix<f64, N, N>,
}

/// Nodes in (0, 1) and weights of the five-point Gauss-Legendre rule.
const GAUSS_LEGENDRE: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Largest norm of drift x step for which series and quadrature are exact to 1e-13.
const NORM_MAX: f64 = 0.25;

/// Terms of the exponential's series: 0.25^13 / 13! = 2e-18.
const TERMS: u32 = 12;

impl<const N: usize> Discrete<N> {
    /// The step of `dt_s` >= 0 seconds.
    ///
    /// F = exp(A dt) by its series and Q = the integral of exp(A s) D exp(A s)' by Gauss-Legendre
    /// quadrature, both over a step short enough and then doubled. Q is a sum of squares with
    /// positive weights: unlike closed forms it cannot lose definiteness when the step is short.
    pub fn new(motion: &impl Motion<N>, dt_s: f64) -> Self {
        let (drift, diffusion) = (motion.drift(), motion.diffusion());
        let mut short_s = dt_s;
        let mut doublings = 0;
        while drift.norm() * short_s > NORM_MAX && doublings < 60 {
            short_s *= 0.5;
            doublings += 1;
        }
        let mut transition = exponential(&(drift * short_s));
        let mut noise = SMatrix::zeros();
        for (node, weight) in GAUSS_LEGENDRE {
            let e = exponential(&(drift * (short_s * node)));
            noise += e * diffusion * e.transpose() * (weight * short_s);
        }
        for _ in 0..doublings {
            noise += transition * noise * transition.transpose();
            transition *= transition;
        }
        Self {
            dt_s,
            transition,
            noise,
        }
    }

    /// The step of `dt_s`, kept in `last`: flights are sampled evenly, mostly.
    pub fn kept<'a>(last: &'a mut Option<Self>, motion: &impl Motion<N>, dt_s: f64) -> &'a Self {
        if last.as_ref().is_some_and(|step| step.dt_s != dt_s) {
            *last = None;
        }
        last.get_or_insert_with(|| Self::new(motion, dt_s))
    }
}

fn exponential<const N: usize>(m: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let mut term = SMatrix::identity();
    let mut sum = term;
    for k in 1..=TERMS {
        term = term * m / f64::from(k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::motion::WhiteAcceleration;
    use crate::baseline::singer::Singer;
    use crate::baseline::turn::Turn;
    use nalgebra::Vector6;

    /// A continuous-time model does not care how a second is cut into steps.
    fn assert_divisible<const N: usize>(motion: &impl Motion<N>) {
        for (first_s, second_s) in [(0.05, 0.05), (0.13, 0.31), (0.9, 2.0)] {
            let (a, b) = (
                Discrete::new(motion, first_s),
                Discrete::new(motion, second_s),
            );
            let both = Discrete::new(motion, first_s + second_s);
            let noise = b.transition * a.noise * b.transition.transpose() + b.noise;
            assert!((noise - both.noise).norm() < 1e-11 * (1.0 + both.noise.norm()));
            assert!((b.transition * a.transition - both.transition).norm() < 1e-11);
            assert!((both.noise - both.noise.transpose()).norm() < 1e-12 * both.noise.norm());
        }
    }

    const TURN: Turn = Turn {
        turn_rate_radps: 0.9,
        damping_per_s: 0.3,
        q_m2_s3: 0.7,
    };
    const SINGER: Singer = Singer {
        acceleration_sigma_mps2: 1.7,
        correlation_time_s: 0.8,
        damping_per_s: 0.0,
        q_m2_s3: 0.0,
    };

    #[test]
    fn two_steps_make_one() {
        assert_divisible(&WhiteAcceleration { q_m2_s3: 0.7 });
        assert_divisible(&TURN);
        assert_divisible(&Turn {
            turn_rate_radps: -3.0,
            ..TURN
        });
        assert_divisible(&SINGER);
        assert_divisible(&Singer {
            correlation_time_s: 0.05,
            damping_per_s: 1.3,
            ..SINGER
        });
        assert_divisible(&Singer {
            correlation_time_s: 40.0,
            q_m2_s3: 0.4,
            ..SINGER
        });
    }

    #[test]
    fn white_acceleration_is_the_textbooks() {
        let step = Discrete::new(&WhiteAcceleration { q_m2_s3: 0.7 }, 0.3);
        assert_eq!(step.transition[(1, 4)], 0.3);
        assert!((step.noise[(2, 2)] - 0.7 * 0.027 / 3.0).abs() < 1e-16);
        assert!((step.noise[(2, 5)] - 0.7 * 0.09 / 2.0).abs() < 1e-16);
        assert!((step.noise[(5, 5)] - 0.7 * 0.3).abs() < 1e-16);
        assert_eq!(step.noise[(0, 1)], 0.0);
    }

    #[test]
    fn an_undamped_turn_returns() {
        let turn = Turn {
            turn_rate_radps: 0.5,
            damping_per_s: 0.0,
            q_m2_s3: 1.0,
        };
        let state = Vector6::new(3.0, 4.0, 5.0, 1.0, 2.0, 0.0);
        let round = Discrete::new(&turn, core::f64::consts::TAU / 0.5).transition * state;
        assert!((round - state).norm() < 1e-12);
        // A quarter turn from east leads north, and to the left of the start.
        let east = Vector6::new(0.0, 0.0, 0.0, 1.0, 0.0, 0.0);
        let quarter = Discrete::new(&turn, core::f64::consts::PI).transition * east;
        assert!((quarter - Vector6::new(2.0, 2.0, 0.0, 0.0, 1.0, 0.0)).norm() < 1e-12);
    }

    /// Singer's closed form (Singer 1970), at a step where it does not cancel.
    #[test]
    fn noise_is_singers_closed_form() {
        let (s2, a, t) = (1.7_f64.powi(2), 1.0 / 0.8, 1.5_f64);
        let (x, e, e2) = (a * t, (-a * t).exp(), (-2.0 * a * t).exp());
        let q = Discrete::new(&SINGER, t).noise;
        let pp = 1.0 - e2 + 2.0 * x + 2.0 * x.powi(3) / 3.0 - 2.0 * x * x - 4.0 * x * e;
        let closed = [
            ((0, 0), s2 / a.powi(4) * pp),
            (
                (1, 4),
                s2 / a.powi(3) * (e2 + 1.0 - 2.0 * e + 2.0 * x * e - 2.0 * x + x * x),
            ),
            ((2, 8), s2 / (a * a) * (1.0 - e2 - 2.0 * x * e)),
            ((3, 3), s2 / (a * a) * (4.0 * e - 3.0 - e2 + 2.0 * x)),
            ((4, 7), s2 / a * (e2 + 1.0 - 2.0 * e)),
            ((8, 8), s2 * (1.0 - e2)),
        ];
        for (at, value) in closed {
            assert!(
                (q[at] / value - 1.0).abs() < 1e-12,
                "{at:?}: {} {value}",
                q[at]
            );
        }
    }
}
