//! The paper's three noise levels, in both readings of its angle column.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Noise level of the paper's table of sensor noise; each is ten times the one before.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, ValueEnum, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum NoiseLevel {
    /// 1 m, 0.01 m/s, 0.001 of the angle unit.
    Low,
    /// 10 m, 0.1 m/s, 0.01 of the angle unit.
    Medium,
    /// 100 m, 1 m/s, 0.1 of the angle unit.
    High,
}

/// The unit of the angle figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseTable {
    /// Radians: how the paper's published code uses the figures.
    #[default]
    Radians,
    /// Degrees: how the paper prints them.
    Printed,
}

/// Standard deviations (1 sigma) of one radar reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseSigmas {
    /// Range, metres.
    pub range_m: f64,
    /// Elevation, radians.
    pub elevation_rad: f64,
    /// Azimuth, radians.
    pub azimuth_rad: f64,
    /// Range-rate, metres per second.
    pub range_rate_mps: f64,
}

impl NoiseLevel {
    /// All levels, lowest first.
    pub const ALL: [Self; 3] = [Self::Low, Self::Medium, Self::High];

    /// The standard deviations of this level.
    #[must_use]
    pub fn sigmas(self, table: NoiseTable) -> NoiseSigmas {
        let (range_m, range_rate_mps, angle) = match self {
            Self::Low => (1.0, 0.01, 0.001),
            Self::Medium => (10.0, 0.1, 0.01),
            Self::High => (100.0, 1.0, 0.1),
        };
        let angle_rad = match table {
            NoiseTable::Radians => angle,
            NoiseTable::Printed => f64::to_radians(angle),
        };
        NoiseSigmas {
            range_m,
            elevation_rad: angle_rad,
            azimuth_rad: angle_rad,
            range_rate_mps,
        }
    }
}

impl std::fmt::Display for NoiseLevel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        })
    }
}

impl std::fmt::Display for NoiseTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Radians => "radians",
            Self::Printed => "printed",
        })
    }
}

/// Errors of both angles of a counter-UAS surveillance radar at low, medium and high noise, degrees.
pub const COUNTER_UAS_ANGLES_DEG: [f64; 3] = [0.3, 0.5, 0.7];

impl NoiseSigmas {
    /// A counter-UAS surveillance radar with this error of both angles.
    #[must_use]
    pub fn counter_uas(angle_deg: f64) -> Self {
        let angle_rad = angle_deg.to_radians();
        Self {
            range_m: 3.0,
            elevation_rad: angle_rad,
            azimuth_rad: angle_rad,
            range_rate_mps: 0.2,
        }
    }

    /// All four standard deviations times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            range_m: self.range_m * factor,
            elevation_rad: self.elevation_rad * factor,
            azimuth_rad: self.azimuth_rad * factor,
            range_rate_mps: self.range_rate_mps * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{NoiseLevel, NoiseTable};
    use clap::ValueEnum;

    #[test]
    fn levels_are_the_papers() {
        let low = NoiseLevel::Low.sigmas(NoiseTable::Radians);
        assert_eq!(
            [
                low.range_m,
                low.range_rate_mps,
                low.elevation_rad,
                low.azimuth_rad
            ],
            [1.0, 0.01, 0.001, 0.001]
        );
        for (level, factor) in [(NoiseLevel::Medium, 10.0), (NoiseLevel::High, 100.0)] {
            let (got, want) = (level.sigmas(NoiseTable::Radians), low.scaled(factor));
            assert!((got.range_m - want.range_m).abs() < 1e-12);
            assert!((got.elevation_rad - want.elevation_rad).abs() < 1e-15);
            assert!((got.azimuth_rad - want.azimuth_rad).abs() < 1e-15);
            assert!((got.range_rate_mps - want.range_rate_mps).abs() < 1e-14);
        }
    }

    #[test]
    fn printed_angles_are_degrees() {
        let printed = NoiseLevel::High.sigmas(NoiseTable::Printed);
        assert!((printed.azimuth_rad - 0.1 * std::f64::consts::PI / 180.0).abs() < 1e-15);
        assert_eq!(printed.azimuth_rad, printed.elevation_rad);
        assert_eq!(printed.range_m, 100.0);
        assert_eq!(printed.range_rate_mps, 1.0);
    }

    #[test]
    fn the_command_line_spells_levels_as_they_print() {
        for level in NoiseLevel::ALL {
            let spelt = level.to_possible_value().unwrap().get_name().to_owned();
            assert_eq!(spelt, level.to_string());
            assert_eq!(
                serde_json::to_string(&level).unwrap(),
                format!("\"{level}\"")
            );
        }
        for table in [NoiseTable::Radians, NoiseTable::Printed] {
            let spelt = table.to_possible_value().unwrap().get_name().to_owned();
            assert_eq!(spelt, table.to_string());
            assert_eq!(
                serde_json::to_string(&table).unwrap(),
                format!("\"{table}\"")
            );
        }
    }
}
