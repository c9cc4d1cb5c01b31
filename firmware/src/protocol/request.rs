//! What the host asks of the image.

use serde::{Deserialize, Serialize};

use crate::protocol::HORIZONS;
use crate::{Correction, Inference, Measurement, PassesError, Sensed, Sensor, Settings, Spread};

/// Host to image. The image answers each request with one [`Reply`](crate::protocol::Reply).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Who is there? Answered by `Ready`.
    Hello,
    /// Start a new track. Answered by `Started`.
    Reset(Reset),
    /// One measurement. Answered by `Estimate` or `Refused`.
    Step(MeasurementFrame),
    /// No measurement at this time. Answered by `Estimate` or `Refused`.
    Coast {
        /// Microseconds, same epoch as the measurements.
        time_us: u64,
    },
    /// How much memory is in use? Answered by `Budget`.
    Budget,
    /// Where will the target be? Answered by `Forecast` or `Refused`; the track stays as it is.
    Forecast {
        /// Microseconds, same epoch as the measurements, in order.
        times_us: [u64; HORIZONS],
    },
    /// How well does this measurement fit the track, which stays as it is? Answered by `Likelihood`
    /// or `Refused`.
    Likelihood(MeasurementFrame),
}

/// Settings of a new track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reset {
    /// Seed of the Monte Carlo generator.
    pub seed: u64,
    /// How the networks are asked.
    pub inference: InferenceCode,
    /// Which correction follows the network.
    pub correction: CorrectionCode,
}

impl TryFrom<Reset> for Settings {
    type Error = PassesError;

    fn try_from(reset: Reset) -> Result<Self, PassesError> {
        Ok(Self {
            correction: match reset.correction {
                CorrectionCode::None => Correction::None,
                CorrectionCode::Converted => Correction::Converted,
                CorrectionCode::Polar => Correction::Polar,
            },
            inference: reset.inference.try_into()?,
            seed: reset.seed,
        })
    }
}

impl From<Settings> for Reset {
    fn from(settings: Settings) -> Self {
        Self {
            seed: settings.seed,
            inference: settings.inference.into(),
            correction: match settings.correction {
                Correction::None => CorrectionCode::None,
                Correction::Converted => CorrectionCode::Converted,
                Correction::Polar => CorrectionCode::Polar,
            },
        }
    }
}

/// An [`Inference`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum InferenceCode {
    /// Every weight at its mean.
    Mean,
    /// Monte Carlo passes; [`Inference::of_passes`] says which numbers are taken.
    Passes(u16),
    /// The same with frozen spreads.
    Frozen(u16),
    /// Moments without drawing.
    Moments,
}

impl From<Inference> for InferenceCode {
    fn from(inference: Inference) -> Self {
        match inference {
            Inference::Mean => Self::Mean,
            Inference::Passes(passes) => match passes.spread() {
                Spread::Exact => Self::Passes(passes.count()),
                Spread::Frozen => Self::Frozen(passes.count()),
            },
            Inference::Moments => Self::Moments,
        }
    }
}

impl TryFrom<InferenceCode> for Inference {
    type Error = PassesError;

    fn try_from(code: InferenceCode) -> Result<Self, PassesError> {
        match code {
            InferenceCode::Mean => Ok(Self::Mean),
            InferenceCode::Passes(passes) => Self::of_passes(passes),
            InferenceCode::Frozen(passes) => Self::of_passes(passes).map(Self::frozen),
            InferenceCode::Moments => Ok(Self::Moments),
        }
    }
}

/// The correction step on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CorrectionCode {
    /// The network alone.
    None,
    /// Converted position measurement.
    Converted,
    /// Polar measurement with its Jacobian.
    Polar,
}

/// A [`Measurement`] on the wire, same units and frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasurementFrame {
    /// Microseconds.
    pub time_us: u64,
    /// Metres.
    pub range: Option<SensedFrame>,
    /// Radians.
    pub elevation: Option<SensedFrame>,
    /// Radians.
    pub azimuth: Option<SensedFrame>,
    /// Metres per second, positive outbound.
    pub range_rate: Option<SensedFrame>,
    /// `None` for a sensor at rest in the origin.
    pub sensor: Option<SensorFrame>,
}

/// A [`Sensor`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorFrame {
    /// Metres.
    pub position_m: [f32; 3],
    /// Metres per second.
    pub velocity_mps: [f32; 3],
}

/// A [`Sensed`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensedFrame {
    /// What was measured.
    pub value: f32,
    /// Standard deviation, same unit.
    pub sigma: f32,
}

impl From<Sensed> for SensedFrame {
    fn from(Sensed { value, sigma }: Sensed) -> Self {
        Self { value, sigma }
    }
}

impl From<SensedFrame> for Sensed {
    fn from(SensedFrame { value, sigma }: SensedFrame) -> Self {
        Self { value, sigma }
    }
}

impl From<Sensor> for SensorFrame {
    fn from(
        Sensor {
            position_m,
            velocity_mps,
        }: Sensor,
    ) -> Self {
        Self {
            position_m,
            velocity_mps,
        }
    }
}

impl From<SensorFrame> for Sensor {
    fn from(
        SensorFrame {
            position_m,
            velocity_mps,
        }: SensorFrame,
    ) -> Self {
        Self {
            position_m,
            velocity_mps,
        }
    }
}

impl From<&Measurement> for MeasurementFrame {
    fn from(m: &Measurement) -> Self {
        Self {
            time_us: m.time_us,
            range: m.range.map(Into::into),
            elevation: m.elevation.map(Into::into),
            azimuth: m.azimuth.map(Into::into),
            range_rate: m.range_rate.map(Into::into),
            // The tracker takes a negative zero for zero as well.
            sensor: (m.sensor != Sensor::ORIGIN).then(|| m.sensor.into()),
        }
    }
}

impl From<&MeasurementFrame> for Measurement {
    /// Unchecked: the tracker refuses what it cannot use.
    fn from(f: &MeasurementFrame) -> Self {
        Self {
            time_us: f.time_us,
            range: f.range.map(Into::into),
            elevation: f.elevation.map(Into::into),
            azimuth: f.azimuth.map(Into::into),
            range_rate: f.range_rate.map(Into::into),
            sensor: f.sensor.map_or(Sensor::ORIGIN, Into::into),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{FrameReader, encode};
    use proptest::prelude::*;

    #[test]
    fn settings_survive_the_wire() {
        for correction in [Correction::None, Correction::Converted, Correction::Polar] {
            let passes = Inference::of_passes(77).unwrap();
            for inference in [Inference::Mean, passes, passes.frozen(), Inference::Moments] {
                let settings = Settings {
                    correction,
                    inference,
                    seed: u64::MAX - 1,
                };
                assert_eq!(Settings::try_from(Reset::from(settings)), Ok(settings));
            }
        }
        for none in [InferenceCode::Passes(0), InferenceCode::Frozen(0)] {
            assert_eq!(Inference::try_from(none), Err(PassesError(0)));
        }
    }

    /// The common case costs one byte.
    #[test]
    fn a_sensor_in_the_origin_is_not_sent() {
        let measurement = Measurement {
            time_us: 1,
            range: None,
            elevation: None,
            azimuth: None,
            range_rate: None,
            sensor: Sensor::ORIGIN,
        };
        let frame = MeasurementFrame::from(&measurement);
        assert_eq!(frame.sensor, None);
        assert_eq!(Measurement::from(&frame), measurement);
    }

    proptest! {
        #[test]
        fn a_measurement_survives_the_wire_bit_for_bit(
            time_us in any::<u64>(),
            bits in any::<[u32; 8]>(),
            missing in 0_u8..16,
            place in any::<[u32; 6]>(),
        ) {
            let [a, b, c, d, e, f, g, h] = bits.map(f32::from_bits);
            let channel = |index: u8, value, sigma| {
                (missing & 1 << index == 0).then_some(Sensed { value, sigma })
            };
            let sent = Measurement {
                time_us,
                range: channel(0, a, b),
                elevation: channel(1, c, d),
                azimuth: channel(2, e, f),
                range_rate: channel(3, g, h),
                sensor: Sensor {
                    position_m: core::array::from_fn(|i| f32::from_bits(place[i])),
                    velocity_mps: core::array::from_fn(|i| f32::from_bits(place[3 + i])),
                },
            };
            let frame = encode(&Request::Step(MeasurementFrame::from(&sent))).unwrap();
            let mut reader = FrameReader::new();
            let mut read = frame.iter().filter_map(|&byte| reader.push::<Request>(byte));
            let Some(Ok(Request::Step(received))) = read.next() else { panic!("no step") };
            let received = Measurement::from(&received);
            prop_assert_eq!(received.time_us, time_us);
            let bits = |m: &Measurement| {
                m.channels().map(|c| c.map(|s| (s.value.to_bits(), s.sigma.to_bits())))
            };
            prop_assert_eq!(bits(&received), bits(&sent));
            let place = |m: &Measurement| {
                (m.sensor.position_m.map(f32::to_bits), m.sensor.velocity_mps.map(f32::to_bits))
            };
            if sent.sensor != Sensor::ORIGIN {
                prop_assert_eq!(place(&received), place(&sent));
            }
        }
    }
}
