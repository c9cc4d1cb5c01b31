//! Numbers that an option takes, and what it says of others.

use crate::brief_number::brief;
use std::ops::RangeInclusive;

/// A value parser for numbers within `range`; others are told what `what` is, "a share" for example.
pub fn within(
    range: RangeInclusive<f64>,
    what: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse::<f64>() {
        Ok(number) if range.contains(&number) => Ok(number),
        Ok(_) => {
            let (least, most) = (brief(*range.start()), brief(*range.end()));
            Err(format!("{what} is {least} to {most}"))
        }
        Err(error) => Err(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn numbers_have_bounds() {
        let share = within(0.0..=0.95, "a share");
        assert_eq!((share("0"), share("0.95")), (Ok(0.0), Ok(0.95)));
        for text in ["-0.1", "0.96", "NaN", "inf"] {
            assert_eq!(
                share(text),
                Err("a share is 0 to 0.95".to_owned()),
                "{text}"
            );
        }
        assert!(share("half").is_err());
    }
}
