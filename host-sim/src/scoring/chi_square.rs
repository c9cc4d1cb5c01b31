//! The chi-square distribution: what squared errors follow when a filter's covariance is right.

/// Relative step at which the series and the continued fraction stop.
const RELATIVE_STEP_MIN: f64 = 1e-15;

/// Neither expansion needs more terms below 1e6 degrees of freedom.
const TERMS_MAX: usize = 20_000;

/// Halvings of the bracket in [`quantile`]: past the resolution of an `f64`.
const HALVINGS: usize = 120;

/// Probability that a chi-square variable of `dof` degrees of freedom is at most `x`.
///
/// `dof` need not be whole. Returns 0 for `x <= 0`; accurate to 1e-12.
///
/// # Panics
/// If `dof` is not positive and finite.
pub fn cdf(x: f64, dof: f64) -> f64 {
    assert!(
        dof > 0.0 && dof.is_finite(),
        "degrees of freedom must be positive: {dof}"
    );
    if x <= 0.0 {
        return 0.0;
    }
    if x == f64::INFINITY {
        return 1.0;
    }
    let (a, half) = (0.5 * dof, 0.5 * x);
    // The common factor e^-x x^a / Gamma(a).
    let front = (a * half.ln() - half - libm::lgamma(a)).exp();
    if half < a + 1.0 {
        front * lower_series(a, half)
    } else {
        1.0 - front * upper_fraction(a, half)
    }
}

/// The `x` below which a chi-square variable of `dof` degrees of freedom lies with `probability`.
///
/// # Panics
/// If `probability` is outside (0, 1) or `dof` is not positive and finite.
pub fn quantile(probability: f64, dof: f64) -> f64 {
    assert!(
        probability > 0.0 && probability < 1.0,
        "probability must lie in (0, 1): {probability}"
    );
    let (mut low, mut high) = (0.0, dof.max(1.0));
    while cdf(high, dof) < probability {
        low = high;
        high *= 2.0;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if cdf(middle, dof) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Lower incomplete gamma function over its common factor, by its power series.
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    for n in 1..TERMS_MAX {
        term *= x / (a + n as f64);
        sum += term;
        if term < sum * RELATIVE_STEP_MIN {
            break;
        }
    }
    sum
}

/// Upper incomplete gamma function over its common factor, by Lentz's continued fraction.
fn upper_fraction(a: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut value = d;
    for n in 1..TERMS_MAX {
        let numerator = -(n as f64) * (n as f64 - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b).max(TINY);
        c = (b + numerator / c).max(TINY);
        let step = d * c;
        value *= step;
        if (step - 1.0).abs() < RELATIVE_STEP_MIN {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::{cdf, quantile};
    use bnkf_model_export::scoring::step_score::QUANTILE_90_DOF_3;

    /// Values of scipy.stats.chi2 1.17.1: (probability, degrees of freedom, quantile).
    const KNOWN: [(f64, f64, f64); 10] = [
        (0.50, 3.0, 2.365_973_884_375_338),
        (0.90, 3.0, 6.251_388_631_170_325),
        (0.95, 3.0, 7.814_727_903_251_179),
        (0.90, 1.0, 2.705_543_454_095_404),
        (0.95, 2.0, 5.991_464_547_107_98),
        (0.025, 4.0, 0.484_418_557_087_929_6),
        (0.975, 4.0, 11.143_286_781_877_8),
        (0.05, 1.7, 0.056_026_279_430_737_41),
        (0.025, 450.0, 393.117_687_849_230_1),
        (0.975, 30_000.0, 30_481.982_656_347_922),
    ];

    #[test]
    fn quantiles_match_published_values() {
        for (probability, dof, expected) in KNOWN {
            let found = quantile(probability, dof);
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "chi2_{dof} at {probability}: {found} against {expected}"
            );
        }
        assert_eq!(QUANTILE_90_DOF_3, KNOWN[1].2);
    }

    #[test]
    fn two_degrees_of_freedom_are_an_exponential_distribution() {
        for x in [1e-6_f64, 0.3, 1.0, 3.9, 4.1, 25.0, 80.0] {
            let expected = -(-0.5 * x).exp_m1();
            assert!((cdf(x, 2.0) - expected).abs() < 1e-13, "at {x}");
        }
    }

    #[test]
    fn quantile_inverts_cdf() {
        for dof in [0.4, 1.0, 3.0, 17.5, 900.0] {
            for probability in [1e-4, 0.05, 0.5, 0.9, 0.9999] {
                let back = cdf(quantile(probability, dof), dof);
                assert!(
                    (back - probability).abs() < 1e-11,
                    "{dof} {probability}: {back}"
                );
            }
        }
    }

    #[test]
    fn the_ends_are_exact() {
        assert_eq!(cdf(-1.0, 3.0), 0.0);
        assert_eq!(cdf(0.0, 3.0), 0.0);
        assert_eq!(cdf(f64::INFINITY, 3.0), 1.0);
    }

    #[test]
    #[should_panic(expected = "probability")]
    fn a_probability_of_one_has_no_quantile() {
        quantile(1.0, 3.0);
    }
}
