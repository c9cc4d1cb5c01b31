//! Elementary functions in f64 that the compiler evaluates to fill constant tables.
//!
//! Never called at run time: tables cost flash, not instructions.

/// `exp(x)` for |x| < 700: argument halved until small, Taylor series, squared back.
pub(crate) const fn exp(x: f64) -> f64 {
    let mut halvings = 0;
    let mut r = x;
    while r > 0.5 || r < -0.5 {
        r *= 0.5;
        halvings += 1;
    }
    let mut term = 1.0;
    let mut sum = 1.0;
    let mut n = 1;
    while n < 20 {
        term *= r / n as f64;
        sum += term;
        n += 1;
    }
    while halvings > 0 {
        sum *= sum;
        halvings -= 1;
    }
    sum
}

/// Square root of a positive number by Newton's iteration.
pub(crate) const fn sqrt(x: f64) -> f64 {
    let mut y = if x > 1.0 { x } else { 1.0 };
    let mut n = 0;
    while n < 60 {
        y = 0.5 * (y + x / y);
        n += 1;
    }
    y
}

/// Natural logarithm of a positive number by Newton's iteration on [`exp`].
pub(crate) const fn ln(x: f64) -> f64 {
    let mut y = 0.0;
    let mut n = 0;
    while n < 40 {
        let e = exp(y);
        y += 2.0 * (x - e) / (x + e);
        n += 1;
    }
    y
}

const INVERSE_SQRT_TWO_PI: f64 = 0.398_942_280_401_432_7;

/// Standard normal density.
pub(crate) const fn normal_density(x: f64) -> f64 {
    INVERSE_SQRT_TWO_PI * exp(-0.5 * x * x)
}

/// Standard normal distribution function for |x| <= 6, from the all-positive series
/// `Phi(x) = 1/2 + phi(x) (x + x^3/3 + x^5/15 + ...)` (Marsaglia 2004).
pub(crate) const fn normal_cdf(x: f64) -> f64 {
    let mut term = x;
    let mut sum = x;
    let mut n = 1;
    while n < 90 {
        term *= x * x / (2 * n + 1) as f64;
        sum += term;
        n += 1;
    }
    0.5 + sum * normal_density(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_agree_with_libm() {
        for i in -40..=40 {
            let x = f64::from(i) * 0.15;
            assert!((exp(x) / libm::exp(x) - 1.0).abs() < 1e-13);
            let y = libm::exp(x);
            assert!((ln(y) - x).abs() < 1e-13 * (1.0 + x.abs()));
            assert!((sqrt(y) / libm::sqrt(y) - 1.0).abs() < 1e-15 * 4.0);
            let cdf = 0.5 * libm::erfc(-x / core::f64::consts::SQRT_2);
            assert!((normal_cdf(x) - cdf).abs() < 1e-13, "{x}");
        }
    }
}
