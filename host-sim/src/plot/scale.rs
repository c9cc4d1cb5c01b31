//! How values become positions along an axis, and where its ticks go.

/// A linear or logarithmic axis over a closed range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
}

/// A labelled place on an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where.
    pub value: f64,
    /// What it says; empty for a minor tick.
    pub label: String,
}

impl Scale {
    /// A linear axis. An empty or reversed range is widened to one.
    pub fn linear(low: f64, high: f64) -> Self {
        let high = if high > low { high } else { low + 1.0 };
        Self {
            low,
            high,
            logarithmic: false,
        }
    }

    /// A logarithmic axis that holds every positive value of `values` and spans at least a factor
    /// of four; its ends are 1, 2 or 5 times a power of ten.
    pub fn logarithmic_over(values: impl Iterator<Item = f64>) -> Self {
        let usable = values.filter(|value| value.is_finite() && *value > 0.0);
        let (low, high) = usable.fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        if low > high {
            return Self {
                low: 0.1,
                high: 10.0,
                logarithmic: true,
            };
        }
        let (mut low, mut high) = (round_down(low / 1.05), round_up(high * 1.05));
        if high / low < 4.0 {
            (low, high) = (round_down(low / 1.5), round_up(high * 1.5));
        }
        Self {
            low,
            high,
            logarithmic: true,
        }
    }

    /// Lower end.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Upper end.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Position between the ends, 0 at the lower and 1 at the upper; outside that for values
    /// outside the range. Zero and negative values on a logarithmic axis lie far below it.
    pub fn fraction(&self, value: f64) -> f64 {
        if !self.logarithmic {
            return (value - self.low) / (self.high - self.low);
        }
        if value <= 0.0 {
            return -10.0;
        }
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Ticks from low to high: about `wanted` on a linear axis; on a logarithmic one the powers of
    /// ten, with 2 and 5 between them when they are few, every second or third when they are many.
    pub fn ticks(&self, wanted: usize) -> Vec<Tick> {
        if self.logarithmic {
            self.logarithmic_ticks(wanted.max(1))
        } else {
            self.linear_ticks(wanted)
        }
    }

    fn linear_ticks(&self, wanted: usize) -> Vec<Tick> {
        let step = round_up((self.high - self.low) / wanted.max(1) as f64);
        let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last)
            .map(|n| {
                let value = n as f64 * step;
                Tick {
                    value,
                    label: format!("{value:.decimals$}"),
                }
            })
            .collect()
    }

    fn logarithmic_ticks(&self, wanted: usize) -> Vec<Tick> {
        let decades = (self.high / self.low).log10();
        let labelled: &[u32] = if decades < 0.5 * wanted as f64 {
            &[1, 2, 5]
        } else {
            &[1]
        };
        // Over many decades every second or third is labelled, or labels would lie on each other.
        let every = (decades / (wanted + 2) as f64).ceil().max(1.0) as i32;
        let first = self.low.log10().floor() as i32;
        let last = self.high.log10().ceil() as i32;
        let mut ticks = Vec::new();
        for power in first..=last {
            for digit in 1..=9_u32 {
                let value = f64::from(digit) * 10_f64.powi(power);
                let outside = value < self.low * 0.999_999 || value > self.high * 1.000_001;
                // Nine lines a decade over many decades are noise themselves.
                if outside || (decades > 3.5 && digit != 1) {
                    continue;
                }
                let label = if labelled.contains(&digit) && power.rem_euclid(every) == 0 {
                    plain(value)
                } else {
                    String::new()
                };
                ticks.push(Tick { value, label });
            }
        }
        ticks
    }
}

/// A round number in plain notation between 1e-3 and 1e4, as a power of ten beyond.
fn plain(value: f64) -> String {
    let power = (value * 1.000_001).log10().floor() as i32;
    if (0..=3).contains(&power) {
        format!("{value:.0}")
    } else if (-3..0).contains(&power) {
        format!("{value:.*}", power.unsigned_abs() as usize)
    } else {
        format!("{:.0}e{power}", value / 10_f64.powi(power))
    }
}

/// The largest of 1, 2, 5 times a power of ten that is at most `value`.
fn round_down(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let digit = value / power * 1.000_001;
    power
        * if digit >= 5.0 {
            5.0
        } else if digit >= 2.0 {
            2.0
        } else {
            1.0
        }
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `value`.
fn round_up(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let digit = value / power * 0.999_999;
    power
        * if digit <= 1.0 {
            1.0
        } else if digit <= 2.0 {
            2.0
        } else if digit <= 5.0 {
            5.0
        } else {
            10.0
        }
}

#[cfg(test)]
mod tests {
    use super::Scale;

    fn labels(scale: &Scale, wanted: usize) -> Vec<String> {
        let ticks = scale.ticks(wanted);
        ticks
            .into_iter()
            .map(|tick| tick.label)
            .filter(|label| !label.is_empty())
            .collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(
            labels(&Scale::linear(0.0, 1.0), 5),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
        );
        assert_eq!(
            labels(&Scale::linear(-31.0, 14.0), 5),
            ["-30", "-20", "-10", "0", "10"]
        );
        assert_eq!(labels(&Scale::linear(0.0, 15.0), 3), ["0", "5", "10", "15"]);
    }

    #[test]
    fn logarithmic_ends_hold_the_values() {
        let scale = Scale::logarithmic_over([0.13, 42.0, f64::NAN, 0.0, -1.0].into_iter());
        assert_eq!((scale.low(), scale.high()), (0.1, 50.0));
        assert_eq!(labels(&scale, 5), ["0.1", "1", "10"]);
        let many = Scale::logarithmic_over([1.5, 9e8].into_iter());
        assert_eq!(labels(&many, 3), ["1", "100", "1e4", "1e6", "1e8"]);
        let narrow = Scale::logarithmic_over([2.9, 3.1].into_iter());
        assert!(narrow.high() / narrow.low() >= 4.0);
        assert_eq!(labels(&narrow, 5), ["1", "2", "5", "10"]);
    }

    #[test]
    fn fractions_run_from_end_to_end() {
        let linear = Scale::linear(2.0, 4.0);
        assert_eq!(linear.fraction(2.5), 0.25);
        let log = Scale::logarithmic_over([1.3, 60.0].into_iter());
        assert_eq!(log.fraction(log.low()), 0.0);
        assert!((log.fraction(10.0) - 0.5).abs() < 1e-12);
        assert!(log.fraction(0.0) < -1.0);
    }

    #[test]
    fn no_values_still_make_an_axis() {
        let scale = Scale::logarithmic_over(std::iter::empty());
        assert!(scale.low() < scale.high());
        assert!(Scale::linear(3.0, 3.0).high() > 3.0);
    }
}
