//! What a command says about the form of its flight files.

use super::frame::Frame;
use super::time_unit::TimeUnit;

/// Least and most samples a second to take from a flight.
const RATE_HZ_MIN: f64 = 0.1;
const RATE_HZ_MAX: f64 = 1000.0;

/// How flight files are read where their header does not say it.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct ReadOptions {
    /// Unit of the times [default: what the column's name says, else what gives plausible steps and
    /// speeds; other than seconds is then said]
    #[arg(long, value_enum, value_name = "UNIT", requires = "flights")]
    pub time_unit: Option<TimeUnit>,
    /// Axes of the positions: east-north-up, north-east-down, or latitude, longitude, height [default: what
    /// the columns' names say; x,y,z have most of a flight above their origin, which is said]
    #[arg(long, value_enum, requires = "flights")]
    pub frame: Option<Frame>,
    /// Names of the four columns [default: timestamp,tx,ty,tz and other names of the same]
    #[arg(long, value_name = "T,X,Y,Z", requires = "flights", value_parser = names)]
    pub columns: Option<ColumnNames>,
    /// Takes this many samples a second from every flight, whatever it has; between its own samples the flight is
    /// interpolated
    #[arg(long, value_name = "HZ", requires = "flights", value_parser = rate_hz)]
    pub resample: Option<f64>,
}

fn rate_hz(text: &str) -> Result<f64, String> {
    let rate_hz: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (RATE_HZ_MIN..=RATE_HZ_MAX).contains(&rate_hz) {
        Ok(rate_hz)
    } else {
        Err(format!("expected {RATE_HZ_MIN} to {RATE_HZ_MAX}"))
    }
}

/// Names of the columns of time, x, y and z.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnNames(pub [String; 4]);

fn names(text: &str) -> Result<ColumnNames, String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    if names.iter().any(String::is_empty) {
        return Err("a name is empty".to_owned());
    }
    match <[String; 4]>::try_from(names) {
        Ok(names) if (0..4).any(|i| names[..i].contains(&names[i])) => {
            Err("a column is named twice".to_owned())
        }
        Ok(names) => Ok(ColumnNames(names)),
        Err(names) => Err(format!("{} names, four are needed", names.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::{ColumnNames, names, rate_hz};

    #[test]
    fn a_rate_is_one_that_flights_have() {
        assert_eq!(rate_hz("10"), Ok(10.0));
        for wrong in ["0", "-1", "nan", "1e9", "x"] {
            assert!(rate_hz(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn four_names_are_four_columns() {
        let four = ["t", "Pos East", "y", "z"].map(str::to_owned);
        assert_eq!(names("t, Pos East,y,z"), Ok(ColumnNames(four)));
        assert!(names("t,x,y").unwrap_err().contains("3 names"));
        assert!(names("t,x,,z").unwrap_err().contains("empty"));
        assert!(names("t,x,x,z").unwrap_err().contains("twice"));
    }
}
