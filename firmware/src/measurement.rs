//! One radar measurement as the sensor reports it.

/// Standard deviations (1 sigma) that the sensor claims for a [`Measurement`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigmas {
    /// Range, metres.
    pub range_m: f32,
    /// Elevation, radians.
    pub elevation_rad: f32,
    /// Azimuth, radians.
    pub azimuth_rad: f32,
    /// Range-rate, metres per second.
    pub range_rate_mps: f32,
}

/// One radar measurement: range, elevation, azimuth and range-rate at one instant.
///
/// Frame: x east, y north, z up, radar at the origin. Azimuth runs from +x towards +y, elevation
/// from the horizontal plane, range-rate is positive outbound. A noisy range may be negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Time, microseconds since any fixed epoch; never decreases from one measurement to the next.
    pub time_us: u64,
    /// Range, metres.
    pub range_m: f32,
    /// Elevation, radians.
    pub elevation_rad: f32,
    /// Azimuth, radians.
    pub azimuth_rad: f32,
    /// Range-rate, metres per second.
    pub range_rate_mps: f32,
    /// What the sensor claims for its noise.
    pub sigmas: Sigmas,
}

/// The field of a [`Measurement`] that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasurementField {
    /// `range_m`
    Range,
    /// `elevation_rad`
    Elevation,
    /// `azimuth_rad`
    Azimuth,
    /// `range_rate_mps`
    RangeRate,
    /// `sigmas.range_m`
    SigmaRange,
    /// `sigmas.elevation_rad`
    SigmaElevation,
    /// `sigmas.azimuth_rad`
    SigmaAzimuth,
    /// `sigmas.range_rate_mps`
    SigmaRangeRate,
}

/// Why a [`Measurement`] cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasurementError {
    /// The field is NaN or infinite.
    NotFinite(MeasurementField),
    /// The standard deviation is zero or negative.
    NotPositive(MeasurementField),
}

impl core::fmt::Display for MeasurementField {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Range => "range_m",
            Self::Elevation => "elevation_rad",
            Self::Azimuth => "azimuth_rad",
            Self::RangeRate => "range_rate_mps",
            Self::SigmaRange => "sigmas.range_m",
            Self::SigmaElevation => "sigmas.elevation_rad",
            Self::SigmaAzimuth => "sigmas.azimuth_rad",
            Self::SigmaRangeRate => "sigmas.range_rate_mps",
        })
    }
}

impl core::fmt::Display for MeasurementError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite(field) => write!(f, "{field} is not finite"),
            Self::NotPositive(field) => write!(f, "{field} is not positive"),
        }
    }
}

impl core::error::Error for MeasurementError {}

impl Sigmas {
    /// In the order elevation, azimuth, range, range-rate.
    pub fn in_order(&self) -> [f32; 4] {
        [
            self.elevation_rad,
            self.azimuth_rad,
            self.range_m,
            self.range_rate_mps,
        ]
    }
}

impl Measurement {
    /// In the order elevation, azimuth, range, range-rate.
    pub fn in_order(&self) -> [f32; 4] {
        [
            self.elevation_rad,
            self.azimuth_rad,
            self.range_m,
            self.range_rate_mps,
        ]
    }

    /// Checks that every value is finite and every standard deviation positive.
    ///
    /// # Errors
    /// The first field that cannot be used.
    pub fn check(&self) -> Result<(), MeasurementError> {
        use MeasurementField as F;
        let s = &self.sigmas;
        let values = [
            (self.range_m, F::Range),
            (self.elevation_rad, F::Elevation),
            (self.azimuth_rad, F::Azimuth),
            (self.range_rate_mps, F::RangeRate),
        ];
        let sigmas = [
            (s.range_m, F::SigmaRange),
            (s.elevation_rad, F::SigmaElevation),
            (s.azimuth_rad, F::SigmaAzimuth),
            (s.range_rate_mps, F::SigmaRangeRate),
        ];
        for (value, field) in values.into_iter().chain(sigmas) {
            if !value.is_finite() {
                return Err(MeasurementError::NotFinite(field));
            }
        }
        for (value, field) in sigmas {
            if value <= 0.0 {
                return Err(MeasurementError::NotPositive(field));
            }
        }
        Ok(())
    }
}
