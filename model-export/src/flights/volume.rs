//! The part of space around the radar in which a scenario's flights take place.

use serde::{Deserialize, Serialize};

/// A hollow half-ball around the radar, cut by two heights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Volume {
    /// Nearest point of a flight, metres from the radar.
    pub range_m_min: f64,
    /// Farthest point of a flight, metres from the radar.
    pub range_m_max: f64,
    /// Mean of the normal distribution from which the range of a flight's centre is drawn, metres.
    pub range_m_mean: f64,
    /// Standard deviation of that distribution (before flights are made to fit), metres.
    pub range_m_sd: f64,
    /// Lowest point of a flight, metres above the radar.
    pub height_m_min: f64,
    /// Highest point of a flight, metres above the radar.
    pub height_m_max: f64,
}

/// Why a [`Volume`] cannot hold flights.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// A value is NaN or infinite.
    #[error("`{0}` is not finite")]
    NotFinite(&'static str),
    /// A value that must be positive is not.
    #[error("`{0}` is not positive")]
    NotPositive(&'static str),
    /// A lower limit is not below its upper limit.
    #[error("`{0}` is not below `{1}`")]
    Empty(&'static str, &'static str),
}

impl Volume {
    /// The paper's: range 18.7 to 46.9 m (mean 35, sd 8.7), height 4.85 to 24.7 m. The normal
    /// distribution is wider and centred higher, since its tails do not fit.
    pub const PAPER: Self = Self {
        range_m_min: 18.7,
        range_m_max: 46.9,
        range_m_mean: 40.0,
        range_m_sd: 14.0,
        height_m_min: 4.85,
        height_m_max: 24.7,
    };

    /// Drones that a surveillance radar looks for: 0.3 to 3 km, 20 to 400 m high.
    pub const COUNTER_UAS: Self = Self {
        range_m_min: 300.0,
        range_m_max: 3000.0,
        range_m_mean: 1500.0,
        range_m_sd: 700.0,
        height_m_min: 20.0,
        height_m_max: 400.0,
    };

    /// Checks that the volume is not empty.
    ///
    /// # Errors
    /// The first value that makes no sense.
    pub fn check(&self) -> Result<(), VolumeError> {
        for (value, name) in [
            (self.range_m_min, "range_m_min"),
            (self.range_m_max, "range_m_max"),
            (self.range_m_mean, "range_m_mean"),
            (self.range_m_sd, "range_m_sd"),
            (self.height_m_min, "height_m_min"),
            (self.height_m_max, "height_m_max"),
        ] {
            if !value.is_finite() {
                return Err(VolumeError::NotFinite(name));
            }
        }
        for (value, name) in [
            (self.range_m_min, "range_m_min"),
            (self.range_m_sd, "range_m_sd"),
        ] {
            if value <= 0.0 {
                return Err(VolumeError::NotPositive(name));
            }
        }
        let pairs = [
            (
                self.range_m_min,
                "range_m_min",
                self.range_m_max,
                "range_m_max",
            ),
            (
                self.height_m_min,
                "height_m_min",
                self.height_m_max,
                "height_m_max",
            ),
            // A flight below its lowest height at any range has no place.
            (
                self.height_m_min,
                "height_m_min",
                self.range_m_max,
                "range_m_max",
            ),
        ];
        for (low, low_name, high, high_name) in pairs {
            if low >= high {
                return Err(VolumeError::Empty(low_name, high_name));
            }
        }
        Ok(())
    }

    /// Whether a point [x, y, z] (metres, radar at the origin, z up) lies inside.
    #[must_use]
    pub fn contains(&self, position_m: [f64; 3]) -> bool {
        let [x, y, z] = position_m;
        let range_m = (x * x + y * y + z * z).sqrt();
        (self.range_m_min..=self.range_m_max).contains(&range_m)
            && (self.height_m_min..=self.height_m_max).contains(&z)
    }
}

#[cfg(test)]
mod tests {
    use super::{Volume, VolumeError};

    #[test]
    fn the_papers_volume_is_sound_and_bounded() {
        assert_eq!(Volume::PAPER.check(), Ok(()));
        assert!(Volume::PAPER.contains([30.0, 0.0, 10.0]));
        assert!(Volume::PAPER.contains([0.0, -30.0, 24.7]));
        assert!(!Volume::PAPER.contains([30.0, 0.0, 4.8]));
        assert!(!Volume::PAPER.contains([30.0, 0.0, 24.8]));
        assert!(!Volume::PAPER.contains([10.0, 10.0, 10.0]));
        assert!(!Volume::PAPER.contains([40.0, 30.0, 10.0]));
        assert!(!Volume::PAPER.contains([f64::NAN, 30.0, 10.0]));
    }

    #[test]
    fn an_empty_volume_names_its_fault() {
        let with = |change: fn(&mut Volume)| {
            let mut volume = Volume::PAPER;
            change(&mut volume);
            volume.check().unwrap_err()
        };
        assert_eq!(
            with(|v| v.height_m_max = f64::NAN),
            VolumeError::NotFinite("height_m_max")
        );
        assert_eq!(
            with(|v| v.range_m_sd = 0.0),
            VolumeError::NotPositive("range_m_sd")
        );
        assert_eq!(
            with(|v| v.range_m_max = 10.0),
            VolumeError::Empty("range_m_min", "range_m_max")
        );
        assert_eq!(
            with(|v| v.height_m_min = 30.0),
            VolumeError::Empty("height_m_min", "height_m_max")
        );
        assert_eq!(
            with(|v| (v.height_m_min, v.height_m_max) = (50.0, 60.0)),
            VolumeError::Empty("height_m_min", "range_m_max")
        );
    }
}
