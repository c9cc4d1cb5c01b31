//! One radar measurement as the sensor reports it, and what of it can be used.

use core::f32::consts::{FRAC_PI_2, PI};

use crate::scalar::Scalar;
use crate::sensor::{Sensor, SensorError};

/// One measured quantity and the standard deviation (1 sigma) that the sensor claims for it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sensed {
    /// The value: m, rad or m/s.
    pub value: f32,
    /// Its standard deviation, in the same unit.
    pub sigma: f32,
}

/// One radar measurement: range, elevation, azimuth and range-rate at one instant, each of them
/// there or not.
///
/// Frame: x east, y north, z up; range and angles count from the sensor, whose place and motion are
/// the measurement's own. Azimuth runs from +x towards +y, elevation from the horizontal plane,
/// range-rate is relative to the sensor and positive outbound. A noisy range may be negative, which
/// is the point opposite; a noisy elevation may pass the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Measurement {
    /// Time, microseconds since any fixed epoch; never decreases from one measurement to the next.
    pub time_us: u64,
    /// Range, m; magnitude at most [`RANGE_MAX_M`].
    pub range: Option<Sensed>,
    /// Elevation, rad; magnitude at most pi.
    pub elevation: Option<Sensed>,
    /// Azimuth, rad; any turn, magnitude at most [`AZIMUTH_MAX_RAD`].
    pub azimuth: Option<Sensed>,
    /// Range-rate, m/s; magnitude at most [`RANGE_RATE_MAX_MPS`].
    pub range_rate: Option<Sensed>,
    /// Where the sensor is at this time and how it moves; [`Sensor::ORIGIN`] for one that makes the
    /// frame.
    pub sensor: Sensor,
}

/// Largest range, m: a thousand kilometres, beyond every radar's horizon; its fourth power is still
/// far from overflow in single precision.
pub const RANGE_MAX_M: f32 = 1e6;
/// Largest azimuth, rad: sixteen turns, where single precision still tells 1e-5 rad apart.
pub const AZIMUTH_MAX_RAD: f32 = 100.0;
/// Largest range-rate, m/s: faster than anything that flies.
pub const RANGE_RATE_MAX_MPS: f32 = 1e4;
/// Standard deviations of the range, m: from a tenth of a millimetre to where a range says nothing.
pub const RANGE_SIGMA_M: [f32; 2] = [1e-4, 1e5];
/// Standard deviations of an angle, rad: from what single precision resolves to where a direction
/// says nothing. A channel that was not measured is `None`, not a large sigma.
pub const ANGLE_SIGMA_RAD: [f32; 2] = [1e-6, 1.0];
/// Standard deviations of the range-rate, m/s.
pub const RANGE_RATE_SIGMA_MPS: [f32; 2] = [1e-4, 1e4];

/// A part of a [`Measurement`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Channel {
    /// `elevation`
    Elevation,
    /// `azimuth`
    Azimuth,
    /// `range`
    Range,
    /// `range_rate`
    RangeRate,
}

impl Channel {
    /// In the order of vectors of measurements: elevation, azimuth, range, range-rate.
    pub const ALL: [Self; 4] = [Self::Elevation, Self::Azimuth, Self::Range, Self::RangeRate];

    /// Largest magnitude of a value: rad, rad, m, m/s.
    const fn value_max(self) -> f32 {
        match self {
            Self::Elevation => PI,
            Self::Azimuth => AZIMUTH_MAX_RAD,
            Self::Range => RANGE_MAX_M,
            Self::RangeRate => RANGE_RATE_MAX_MPS,
        }
    }

    /// Least and largest standard deviation.
    const fn sigma_limits(self) -> [f32; 2] {
        match self {
            Self::Elevation | Self::Azimuth => ANGLE_SIGMA_RAD,
            Self::Range => RANGE_SIGMA_M,
            Self::RangeRate => RANGE_RATE_SIGMA_MPS,
        }
    }

    /// Whether a standard deviation is within its limits.
    pub(crate) fn takes_sigma(self, sigma: f32) -> bool {
        let [least, most] = self.sigma_limits();
        (least..=most).contains(&sigma)
    }

    /// Checks what was measured in this channel.
    pub(crate) fn check(self, Sensed { value, sigma }: Sensed) -> Result<(), MeasurementError> {
        if !value.is_finite() || !sigma.is_finite() {
            return Err(MeasurementError::NotFinite(self));
        }
        if value.abs() > self.value_max() {
            return Err(MeasurementError::OutOfRange(self));
        }
        if !self.takes_sigma(sigma) {
            return Err(MeasurementError::Sigma(self));
        }
        Ok(())
    }
}

/// Why a [`Measurement`] cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MeasurementError {
    /// The value or the standard deviation is NaN or infinite.
    NotFinite(Channel),
    /// The value is larger than any that is measured.
    OutOfRange(Channel),
    /// The standard deviation is outside its limits.
    Sigma(Channel),
    /// All four channels are missing.
    Empty,
    /// The sensor's position or velocity.
    Sensor(SensorError),
}

impl core::fmt::Display for Channel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Range => "range [m]",
            Self::Elevation => "elevation [rad]",
            Self::Azimuth => "azimuth [rad]",
            Self::RangeRate => "range_rate [m/s]",
        })
    }
}

impl core::fmt::Display for MeasurementError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite(channel) => write!(f, "{channel} is not finite"),
            Self::OutOfRange(channel) => {
                let max = channel.value_max();
                write!(f, "{channel} is not within -{max} to {max}")
            }
            Self::Sigma(channel) => {
                let [least, most] = channel.sigma_limits();
                write!(f, "sigma of {channel} is not within {least} to {most}")
            }
            Self::Empty => f.write_str("nothing was measured"),
            Self::Sensor(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for MeasurementError {}

impl Measurement {
    /// The four channels in the order of vectors of measurements: elevation, azimuth, range,
    /// range-rate.
    pub fn channels(&self) -> [Option<Sensed>; 4] {
        [self.elevation, self.azimuth, self.range, self.range_rate]
    }

    /// Checks that something was measured, and that every value and standard deviation and the sensor
    /// are finite and within their limits.
    ///
    /// # Errors
    /// The first channel that cannot be used, or the sensor.
    pub fn check(&self) -> Result<(), MeasurementError> {
        for (channel, sensed) in Channel::ALL.into_iter().zip(self.channels()) {
            if let Some(sensed) = sensed {
                channel.check(sensed)?;
            }
        }
        if self.channels().iter().all(Option::is_none) {
            return Err(MeasurementError::Empty);
        }
        self.sensor.check().map_err(MeasurementError::Sensor)
    }

    /// The same direction with its azimuth in [-pi, pi) and, where both angles are there, its
    /// elevation in [-pi/2, pi/2]; the sensor without negative zeros.
    pub fn canonical(mut self) -> Self {
        if let (Some(elevation), Some(azimuth)) = (&mut self.elevation, &mut self.azimuth)
            && elevation.value.abs() > FRAC_PI_2
        {
            elevation.value = PI.copysign(elevation.value) - elevation.value;
            azimuth.value = Scalar::wrap(azimuth.value) + PI;
        }
        if let Some(azimuth) = &mut self.azimuth {
            azimuth.value = Scalar::wrap(azimuth.value);
        }
        self.sensor = self.sensor.canonical();
        self
    }
}

/// A measurement as vectors for the filter step, in the order elevation, azimuth, range, range-rate.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vectors<S> {
    /// Values; zero where nothing was measured.
    pub measured: [S; 4],
    /// Standard deviations; one where nothing was measured.
    pub sigmas: [S; 4],
    /// One where something was measured, zero elsewhere.
    pub present: [S; 4],
}

impl<S: Scalar> Vectors<S> {
    /// All four measured.
    pub fn whole(measured: [S; 4], sigmas: [S; 4]) -> Self {
        Self {
            measured,
            sigmas,
            present: [S::constant(1.0); 4],
        }
    }
}

impl Vectors<f32> {
    /// Makes a channel one that was not measured.
    pub(crate) fn miss(&mut self, channel: usize) {
        self.measured[channel] = 0.0;
        self.sigmas[channel] = 1.0;
        self.present[channel] = 0.0;
    }
}

impl From<&Measurement> for Vectors<f32> {
    fn from(measurement: &Measurement) -> Self {
        let channels = measurement.channels();
        Self {
            measured: channels.map(|sensed| sensed.map_or(0.0, |sensed| sensed.value)),
            sigmas: channels.map(|sensed| sensed.map_or(1.0, |sensed| sensed.sigma)),
            present: channels.map(|sensed| if sensed.is_some() { 1.0 } else { 0.0 }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    fn sensed(value: f32, sigma: f32) -> Option<Sensed> {
        Some(Sensed { value, sigma })
    }

    fn usable() -> Measurement {
        Measurement {
            time_us: 0,
            range: sensed(33.0, 0.1),
            elevation: sensed(0.4, 0.005),
            azimuth: sensed(0.5, 0.005),
            range_rate: sensed(0.0, 0.05),
            sensor: Sensor::ORIGIN,
        }
    }

    /// Every channel with each of its limits, just inside and just outside.
    #[test]
    fn limits_are_where_they_are_said_to_be() {
        let set = |channel, sensed| {
            let mut measurement = usable();
            match channel {
                Channel::Elevation => measurement.elevation = sensed,
                Channel::Azimuth => measurement.azimuth = sensed,
                Channel::Range => measurement.range = sensed,
                Channel::RangeRate => measurement.range_rate = sensed,
            }
            measurement.check()
        };
        let limits = [
            (Channel::Elevation, PI, 1e-6, 1.0),
            (Channel::Azimuth, 100.0, 1e-6, 1.0),
            (Channel::Range, 1e6, 1e-4, 1e5),
            (Channel::RangeRate, 1e4, 1e-4, 1e4),
        ];
        for (channel, most, least_sigma, most_sigma) in limits {
            for sign in [-1.0, 1.0] {
                assert_eq!(set(channel, sensed(sign * most, most_sigma)), Ok(()));
                assert_eq!(
                    set(channel, sensed(sign * most * 1.001, most_sigma)),
                    Err(MeasurementError::OutOfRange(channel))
                );
            }
            assert_eq!(set(channel, sensed(0.1, least_sigma)), Ok(()));
            for sigma in [least_sigma * 0.99, most_sigma * 1.01, 0.0, -1.0] {
                assert_eq!(
                    set(channel, sensed(0.1, sigma)),
                    Err(MeasurementError::Sigma(channel))
                );
            }
            for wild in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let expected = Err(MeasurementError::NotFinite(channel));
                assert_eq!(set(channel, sensed(wild, least_sigma)), expected);
                assert_eq!(set(channel, sensed(0.1, wild)), expected);
            }
            assert_eq!(set(channel, None), Ok(()));
        }
    }

    #[test]
    fn nothing_measured_is_an_error() {
        let empty = Measurement {
            time_us: 0,
            range: None,
            elevation: None,
            azimuth: None,
            range_rate: None,
            sensor: Sensor::ORIGIN,
        };
        assert_eq!(empty.check(), Err(MeasurementError::Empty));
    }

    #[test]
    fn a_sensor_that_is_nowhere_is_an_error() {
        let mut measurement = usable();
        measurement.sensor.position_m[2] = f32::NAN;
        let expected = MeasurementError::Sensor(SensorError::NotFinite);
        assert_eq!(measurement.check(), Err(expected));
        assert_eq!(expected.to_string(), "sensor is not finite");
        measurement.sensor.position_m[2] = -1.1e6;
        let expected = MeasurementError::Sensor(SensorError::TooFar);
        assert_eq!(measurement.check(), Err(expected));
        measurement.sensor = Sensor::at([0.0, -0.0, 1e6]);
        assert_eq!(measurement.check(), Ok(()));
        let y = measurement.canonical().sensor.position_m[1];
        assert!(y.is_sign_positive());
    }

    #[test]
    fn errors_name_the_channel_its_unit_and_its_limits() {
        let text = MeasurementError::Sigma(Channel::Range).to_string();
        assert_eq!(text, "sigma of range [m] is not within 0.0001 to 100000");
        let text = MeasurementError::OutOfRange(Channel::RangeRate).to_string();
        assert_eq!(text, "range_rate [m/s] is not within -10000 to 10000");
    }

    #[test]
    fn a_direction_has_one_canonical_name() {
        let named = |elevation, azimuth| {
            let canonical = Measurement {
                elevation: sensed(elevation, 0.01),
                azimuth: sensed(azimuth, 0.02),
                ..usable()
            }
            .canonical();
            let value = |sensed: Option<Sensed>| sensed.unwrap().value;
            (value(canonical.elevation), value(canonical.azimuth))
        };
        let near = |got: (f32, f32), expected: (f32, f32)| {
            assert!((got.0 - expected.0).abs() < 1e-6, "{got:?}");
            assert!((got.1 - expected.1).abs() < 1e-6, "{got:?}");
        };
        assert_eq!(named(0.4, 0.5), (0.4, 0.5));
        near(named(0.4, 0.5 + 2.0 * PI), (0.4, 0.5));
        near(named(PI - 0.4, 0.5 + PI), (0.4, 0.5));
        near(named(PI - 0.4, 0.5 - PI), (0.4, 0.5));
        near(named(0.4 - PI, 0.5 + PI), (-0.4, 0.5));
        near(named(-1.5, -3.0), (-1.5, -3.0));
        // The vertical itself is not passed.
        assert_eq!(named(FRAC_PI_2, 0.5), (FRAC_PI_2, 0.5));
        // An elevation alone stays: there is no azimuth to turn.
        let alone = Measurement {
            elevation: sensed(2.0, 0.01),
            azimuth: None,
            ..usable()
        };
        assert_eq!(alone.canonical(), alone);
    }

    #[test]
    fn vectors_say_what_is_missing() {
        let partial = Measurement {
            range_rate: None,
            ..usable()
        };
        let vectors = Vectors::from(&partial);
        assert_eq!(vectors.measured, [0.4, 0.5, 33.0, 0.0]);
        assert_eq!(vectors.sigmas, [0.005, 0.005, 0.1, 1.0]);
        assert_eq!(vectors.present, [1.0, 1.0, 1.0, 0.0]);
    }
}
