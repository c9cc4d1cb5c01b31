//! What the host asks of the image.

use serde::{Deserialize, Serialize};

use crate::{Correction, Measurement, Settings, Sigmas};

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
}

/// Settings of a new track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reset {
    /// Seed of the Monte Carlo generator.
    pub seed: u64,
    /// Monte Carlo passes a step.
    pub passes: u16,
    /// Which correction follows the network.
    pub correction: CorrectionCode,
}

impl From<Reset> for Settings {
    fn from(reset: Reset) -> Self {
        Self {
            correction: match reset.correction {
                CorrectionCode::None => Correction::None,
                CorrectionCode::Converted => Correction::Converted,
                CorrectionCode::Polar => Correction::Polar,
            },
            passes: reset.passes,
            seed: reset.seed,
        }
    }
}

impl From<Settings> for Reset {
    fn from(settings: Settings) -> Self {
        Self {
            seed: settings.seed,
            passes: settings.passes,
            correction: match settings.correction {
                Correction::None => CorrectionCode::None,
                Correction::Converted => CorrectionCode::Converted,
                Correction::Polar => CorrectionCode::Polar,
            },
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
    pub range_m: f32,
    /// Radians.
    pub elevation_rad: f32,
    /// Radians.
    pub azimuth_rad: f32,
    /// Metres per second, positive outbound.
    pub range_rate_mps: f32,
    /// Metres.
    pub sigma_range_m: f32,
    /// Radians.
    pub sigma_elevation_rad: f32,
    /// Radians.
    pub sigma_azimuth_rad: f32,
    /// Metres per second.
    pub sigma_range_rate_mps: f32,
}

impl From<&Measurement> for MeasurementFrame {
    fn from(m: &Measurement) -> Self {
        Self {
            time_us: m.time_us,
            range_m: m.range_m,
            elevation_rad: m.elevation_rad,
            azimuth_rad: m.azimuth_rad,
            range_rate_mps: m.range_rate_mps,
            sigma_range_m: m.sigmas.range_m,
            sigma_elevation_rad: m.sigmas.elevation_rad,
            sigma_azimuth_rad: m.sigmas.azimuth_rad,
            sigma_range_rate_mps: m.sigmas.range_rate_mps,
        }
    }
}

impl From<&MeasurementFrame> for Measurement {
    /// Unchecked: the tracker refuses what it cannot use.
    fn from(f: &MeasurementFrame) -> Self {
        Self {
            time_us: f.time_us,
            range_m: f.range_m,
            elevation_rad: f.elevation_rad,
            azimuth_rad: f.azimuth_rad,
            range_rate_mps: f.range_rate_mps,
            sigmas: Sigmas {
                range_m: f.sigma_range_m,
                elevation_rad: f.sigma_elevation_rad,
                azimuth_rad: f.sigma_azimuth_rad,
                range_rate_mps: f.sigma_range_rate_mps,
            },
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
            let settings = Settings {
                correction,
                passes: 77,
                seed: u64::MAX - 1,
            };
            assert_eq!(Settings::from(Reset::from(settings)), settings);
        }
    }

    proptest! {
        #[test]
        fn a_measurement_survives_the_wire_bit_for_bit(
            time_us in any::<u64>(),
            bits in any::<[u32; 8]>(),
        ) {
            let [a, b, c, d, e, f, g, h] = bits.map(f32::from_bits);
            let sent = Measurement {
                time_us,
                range_m: a,
                elevation_rad: b,
                azimuth_rad: c,
                range_rate_mps: d,
                sigmas: Sigmas { range_m: e, elevation_rad: f, azimuth_rad: g, range_rate_mps: h },
            };
            let frame = encode(&Request::Step(MeasurementFrame::from(&sent))).unwrap();
            let mut reader = FrameReader::new();
            let mut read = frame.iter().filter_map(|&byte| reader.push::<Request>(byte));
            let Some(Ok(Request::Step(received))) = read.next() else { panic!("no step") };
            let received = Measurement::from(&received);
            prop_assert_eq!(received.time_us, time_us);
            let s = &received.sigmas;
            let received_bits = [
                received.range_m, received.elevation_rad, received.azimuth_rad,
                received.range_rate_mps, s.range_m, s.elevation_rad, s.azimuth_rad,
                s.range_rate_mps,
            ].map(f32::to_bits);
            prop_assert_eq!(received_bits, bits);
        }
    }
}
