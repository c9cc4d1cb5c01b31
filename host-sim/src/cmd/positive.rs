//! Standard deviations on the command line.

/// A number above zero that a radar may state.
///
/// # Errors
/// Something else, said in words.
pub fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number > 0.0 && number < 1e6 {
        Ok(number)
    } else {
        Err("expected more than 0 and less than 1e6".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::positive;

    #[test]
    fn a_standard_deviation_is_positive() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "inf", "x"] {
            assert!(positive(wrong).is_err(), "{wrong}");
        }
    }
}
