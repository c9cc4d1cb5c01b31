//! Numbers in messages: an error about 1e300 needs no three hundred zeros.

/// `value` as a person writes it: plain within reason, with an exponent beyond.
#[must_use]
pub fn brief(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (1e-9..1e15).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::brief;

    #[test]
    fn numbers_are_short_and_exact() {
        for (value, text) in [
            (0.0, "0"),
            (-1.5, "-1.5"),
            (1_700_000_000_000.0, "1700000000000"),
            (1e300, "1e300"),
            (-2.5e-300, "-2.5e-300"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(brief(value), text);
        }
    }
}
