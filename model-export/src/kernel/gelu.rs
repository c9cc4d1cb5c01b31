//! Sampled pre-activations, GELU (`x * Phi(x)`) and their derivatives.

use super::normal::exp;
use super::tier::per_tier;

/// What a hidden layer keeps of a forward pass for the way back; all of one shape.
pub struct Hidden<'a> {
    /// Activation: GELU of the sampled pre-activation.
    pub activation: &'a mut [f32],
    /// Its square, the factor of the weight variances.
    pub square: &'a mut [f32],
    /// Derivative of GELU at the pre-activation.
    pub slope: &'a mut [f32],
    /// Derivative of the sampled pre-activation with respect to its variance.
    pub gain: &'a mut [f32],
}

per_tier! {
    /// Samples `mean + sqrt(variance) * noise` and applies GELU.
    fn hidden_forward(mean: &[f32], variance: &[f32], noise: &[f32], hidden: Hidden<'_>)
        => hidden_forward_body, hidden_forward_body, hidden_forward_body
}

per_tier! {
    /// Samples the outputs: replaces `mean` by `mean + sqrt(variance) * noise`, and `variance` by
    /// the derivative with respect to it.
    fn sample_output(mean: &mut [f32], variance: &mut [f32], noise: &[f32])
        => sample_output_body, sample_output_body, sample_output_body
}

per_tier! {
    /// From the loss gradient of the next layer's inputs (through its means, `through_mean`, and
    /// its variances, `through_variance`) to that of this layer's pre-activation moments, in place.
    fn hidden_backward(
        through_mean: &mut [f32],
        through_variance: &mut [f32],
        activation: &[f32],
        slope: &[f32],
        gain: &[f32],
    ) => hidden_backward_body, hidden_backward_body, hidden_backward_body
}

/// Keeps the square root of a padding's zero variance away from a division by zero.
const VARIANCE_MIN: f32 = 1e-30;

/// Magnitude scale of Abramowitz and Stegun 26.2.17.
const TAIL_SCALE: f32 = 0.231_641_9;

/// Standard normal distribution function and density at `x`, given `t = 1 / (1 + 0.2316419 |x|)`.
/// Abramowitz and Stegun 26.2.17: the distribution function is within 3e-7 in f32.
#[inline(always)]
fn normal_cdf_pdf(x: f32, t: f32) -> (f32, f32) {
    const FRAC_1_SQRT_TAU: f32 = 0.398_942_3;
    let density = exp(-0.5 * x * x) * FRAC_1_SQRT_TAU;
    let mut series = 1.330_274_5;
    for coefficient in [-1.821_255_9, 1.781_477_9, -0.356_563_78, 0.319_381_54] {
        series = t.mul_add(series, coefficient);
    }
    let upper_tail = density * t * series;
    (
        if x < 0.0 {
            upper_tail
        } else {
            1.0 - upper_tail
        },
        density,
    )
}

#[inline(always)]
fn hidden_forward_body(mean: &[f32], variance: &[f32], noise: &[f32], hidden: Hidden<'_>) {
    let len = mean.len();
    let (variance, noise) = (&variance[..len], &noise[..len]);
    let (activation, square) = (&mut hidden.activation[..len], &mut hidden.square[..len]);
    let (slope, gain) = (&mut hidden.slope[..len], &mut hidden.gain[..len]);
    for i in 0..len {
        let sigma = variance[i].max(VARIANCE_MIN).sqrt();
        let x = sigma.mul_add(noise[i], mean[i]);
        // One division for the two reciprocals 1 / sigma and t.
        let magnitude = TAIL_SCALE.mul_add(x.abs(), 1.0);
        let reciprocal = 1.0 / (sigma * magnitude);
        let (cdf, pdf) = normal_cdf_pdf(x, sigma * reciprocal);
        let y = x * cdf;
        activation[i] = y;
        square[i] = y * y;
        slope[i] = x.mul_add(pdf, cdf);
        gain[i] = 0.5 * noise[i] * (magnitude * reciprocal);
    }
}

#[inline(always)]
fn sample_output_body(mean: &mut [f32], variance: &mut [f32], noise: &[f32]) {
    let len = mean.len();
    let (variance, noise) = (&mut variance[..len], &noise[..len]);
    for i in 0..len {
        let sigma = variance[i].max(VARIANCE_MIN).sqrt();
        mean[i] = sigma.mul_add(noise[i], mean[i]);
        variance[i] = 0.5 * noise[i] / sigma;
    }
}

#[inline(always)]
fn hidden_backward_body(
    through_mean: &mut [f32],
    through_variance: &mut [f32],
    activation: &[f32],
    slope: &[f32],
    gain: &[f32],
) {
    let len = through_mean.len();
    let through_variance = &mut through_variance[..len];
    let (activation, slope, gain) = (&activation[..len], &slope[..len], &gain[..len]);
    for i in 0..len {
        let total = (2.0 * activation[i]).mul_add(through_variance[i], through_mean[i]);
        through_mean[i] = total * slope[i];
        through_variance[i] = through_mean[i] * gain[i];
    }
}

#[cfg(test)]
mod tests {
    use super::super::Tier;
    use super::{Hidden, TAIL_SCALE, hidden_forward, normal_cdf_pdf};

    #[test]
    fn normal_distribution_function_is_within_its_bound() {
        for i in -100_000..=100_000 {
            let x = i as f32 * 1e-4;
            let (cdf, pdf) = normal_cdf_pdf(x, 1.0 / (1.0 + TAIL_SCALE * x.abs()));
            let exact = 0.5 * libm::erfc(-f64::from(x) * std::f64::consts::FRAC_1_SQRT_2);
            let error = (f64::from(cdf) - exact).abs();
            assert!(error < 3e-7, "{x}: {error:e}");
            let density = (-0.5 * f64::from(x).powi(2)).exp() / (2.0 * std::f64::consts::PI).sqrt();
            assert!((f64::from(pdf) - density).abs() < 1e-7, "{x}");
        }
    }

    #[test]
    fn slope_and_gain_are_derivatives_and_every_tier_agrees() {
        let n = 48;
        let mean: Vec<f32> = (0..n).map(|i| i as f32 * 0.2 - 5.0).collect();
        let variance: Vec<f32> = (0..n).map(|i| 0.01 + 0.02 * i as f32).collect();
        let noise: Vec<f32> = (0..n).map(|i| (i % 7) as f32 * 0.6 - 1.8).collect();
        let mut reference: Option<Vec<Vec<f32>>> = None;
        for tier in Tier::available() {
            let mut out = vec![vec![0.0_f32; n]; 4];
            let [activation, square, slope, gain] = &mut out[..] else {
                unreachable!()
            };
            hidden_forward(
                tier,
                &mean,
                &variance,
                &noise,
                Hidden {
                    activation,
                    square,
                    slope,
                    gain,
                },
            );
            for i in 0..n {
                let gelu = |x: f64| x * 0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2);
                let point = |dv: f64| {
                    f64::from(mean[i]) + (f64::from(variance[i]) + dv).sqrt() * f64::from(noise[i])
                };
                let slope = (gelu(point(0.0) + 1e-5) - gelu(point(0.0) - 1e-5)) / 2e-5;
                let gain = (point(1e-6) - point(-1e-6)) / 2e-6;
                assert!((f64::from(out[0][i]) - gelu(point(0.0))).abs() < 2e-6);
                assert_eq!(out[1][i], out[0][i] * out[0][i]);
                assert!((f64::from(out[2][i]) - slope).abs() < 1e-6);
                assert!((f64::from(out[3][i]) - gain).abs() < 1e-5 * gain.abs().max(1.0));
            }
            assert_eq!(
                reference.get_or_insert_with(|| out.clone()),
                &out,
                "{}",
                tier.name()
            );
        }
    }
}
