//! Bins of a true quantity: an honest covariance is as honest in each of them.

use bnkf_model_export::flights::flight::Motion;
use serde::Serialize;

/// The true quantity that sorts steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// Speed of the target, m/s.
    Speed,
    /// Magnitude of its acceleration, m/s^2.
    Acceleration,
}

/// An interval of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Of which quantity.
    pub by: By,
    /// Lower end, which belongs to it.
    pub low: f64,
    /// Upper end, which does not; infinite (`null` in JSON) for the last.
    pub high: f64,
}

impl By {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Speed, Self::Acceleration];

    /// Name in tables and results.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
        }
    }

    /// Its unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Speed => "m/s",
            Self::Acceleration => "m/s²",
        }
    }

    /// Width of a bin, and number of bins before the one that has no end.
    const fn grid(self) -> (f64, usize) {
        match self {
            Self::Speed => (2.0, 6),
            Self::Acceleration => (4.0, 5),
        }
    }

    /// Its value in `motion`.
    pub const fn of(self, motion: &Motion) -> f64 {
        match self {
            Self::Speed => motion.speed_mps,
            Self::Acceleration => motion.acceleration_mps2,
        }
    }

    /// Its bins, from zero upwards.
    pub fn bins(self) -> Vec<Bin> {
        let (width, count) = self.grid();
        let bin = |index: usize| Bin {
            by: self,
            low: index as f64 * width,
            high: if index < count {
                (index + 1) as f64 * width
            } else {
                f64::INFINITY
            },
        };
        (0..=count).map(bin).collect()
    }

    /// Number of the bin that `motion` falls into.
    pub fn index(self, motion: &Motion) -> usize {
        let (width, count) = self.grid();
        // The cast saturates.
        ((self.of(motion) / width) as usize).min(count)
    }
}

impl std::fmt::Display for Bin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.high.is_finite() {
            f.pad(&format!("{}-{}", self.low, self.high))
        } else {
            f.pad(&format!("{}+", self.low))
        }
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Motion;

    use super::By;

    #[test]
    fn bins_are_named_by_their_ends() {
        let names = |by: By| {
            by.bins()
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
        };
        let speeds = ["0-2", "2-4", "4-6", "6-8", "8-10", "10-12", "12+"];
        assert_eq!(names(By::Speed), speeds);
        let accelerations = ["0-4", "4-8", "8-12", "12-16", "16-20", "20+"];
        assert_eq!(names(By::Acceleration), accelerations);
        let json = serde_json::to_value(By::Speed.bins()[6]).unwrap();
        assert_eq!(json["by"], "speed");
        assert!(json["low"] == 12.0 && json["high"].is_null());
    }

    #[test]
    fn a_lower_end_belongs_to_its_bin() {
        for by in By::ALL {
            for (index, bin) in by.bins().iter().enumerate() {
                for value in [bin.low, (bin.high - 1e-9).min(1e9)] {
                    let motion = Motion {
                        speed_mps: value,
                        acceleration_mps2: value,
                    };
                    assert_eq!(by.index(&motion), index, "{bin}: {value}");
                }
            }
        }
    }
}
