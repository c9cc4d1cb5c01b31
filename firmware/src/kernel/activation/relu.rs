//! ReLU, `max(x, 0)`.

/// ReLU of `x`. NaN gives NaN, which `f32::max` would hide.
#[inline]
pub fn relu(x: f32) -> f32 {
    if x <= 0.0 { 0.0 } else { x }
}

#[cfg(test)]
mod tests {
    use super::relu;

    #[test]
    fn what_is_not_positive_is_zero() {
        assert_eq!([-1.0, -0.0, 0.0, 0.5].map(relu), [0.0, 0.0, 0.0, 0.5]);
        assert_eq!(relu(f32::NEG_INFINITY), 0.0);
        assert!(relu(f32::NAN).is_nan());
    }
}
