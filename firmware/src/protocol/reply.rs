//! What the image answers.

use serde::{Deserialize, Serialize};

use super::forecast::ForecastFrame;
use super::likelihood::LikelihoodFrame;
use crate::{Estimate, Mode, Motion, PassesError, StepError, TrackerError};

/// Image to host, one for each [`Request`](crate::protocol::Request).
// One reply exists at a time; a smaller one would save nothing.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// Answer to `Hello`.
    Ready(Ready),
    /// Answer to `Reset`: the new track waits for its first measurement.
    Started,
    /// Answer to `Step` and `Coast`.
    Estimate(EstimateFrame),
    /// Answer to `Budget`.
    Budget(BudgetFrame),
    /// The request had no effect.
    Refused(RefusalCode),
    /// Answer to `Forecast`.
    Forecast(ForecastFrame),
    /// Answer to `Likelihood`.
    Likelihood(LikelihoodFrame),
}

/// Who the image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ready {
    /// [`VERSION`](crate::protocol::VERSION) the image was built with.
    pub protocol_version: u8,
    /// Length of the blob in flash, bytes.
    pub blob_bytes: u32,
    /// CRC-32 that the blob in flash carries and was checked against.
    pub blob_crc: u32,
}

/// An estimate on the wire: metres, frame as in [`Measurement`](crate::Measurement).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateFrame {
    /// Microseconds.
    pub time_us: u64,
    /// x, y, z, metres.
    pub position_m: [f32; 3],
    /// Covariance of the position, row by row, m^2.
    pub covariance_m2: [[f32; 3]; 3],
    /// Normalised innovation squared; zero when nothing was corrected.
    pub nis: f32,
    /// What the tracker did.
    pub mode: ModeCode,
    /// Whether the target is where, or moves as, the model was not trained for.
    pub outside: bool,
    /// Probability that the target manoeuvred, against the model.
    pub manoeuvre: f32,
    /// Probability that the reading is wrong.
    pub outlier: f32,
    /// What a recursive tracker knows beside the position.
    pub motion: Option<MotionFrame>,
    /// Ticks of the board's free-running counter spent inside the tracker. In QEMU under
    /// `-icount shift=0` one tick is one instruction; on a board it is one timer clock.
    pub ticks: u32,
}

impl EstimateFrame {
    /// An estimate and what it cost.
    pub fn new(estimate: &Estimate, ticks: u32) -> Self {
        Self {
            time_us: estimate.time_us,
            position_m: estimate.position_m,
            covariance_m2: estimate.covariance_m2,
            nis: estimate.nis,
            mode: match estimate.mode {
                Mode::Started => ModeCode::Started,
                Mode::Tracking => ModeCode::Tracking,
                Mode::Coasting => ModeCode::Coasting,
                Mode::Rejected => ModeCode::Rejected,
                Mode::Restarted => ModeCode::Restarted,
            },
            outside: estimate.outside,
            manoeuvre: estimate.doubt.manoeuvre,
            outlier: estimate.doubt.outlier,
            motion: estimate.motion.as_ref().map(MotionFrame::new),
            ticks,
        }
    }

    /// Whether two estimates are the same to the last bit, whatever they cost. Unlike `==` this
    /// tells 0 from -0, and a NaN is the same as itself.
    pub fn same_bits(&self, other: &Self) -> bool {
        let floats = |e: &Self| {
            let mut bits = [0u32; 15];
            let values = e.position_m.iter().chain(e.covariance_m2.as_flattened());
            let values = values.chain([&e.nis, &e.manoeuvre, &e.outlier]);
            for (bit, value) in bits.iter_mut().zip(values) {
                *bit = value.to_bits();
            }
            (bits, e.motion.map(|motion| motion.bits()))
        };
        self.time_us == other.time_us
            && (self.mode, self.outside) == (other.mode, other.outside)
            && floats(self) == floats(other)
    }
}

/// A recursive tracker's motion on the wire; frame as in [`Measurement`](crate::Measurement).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionFrame {
    /// Velocity, m/s.
    pub velocity_mps: [f32; 3],
    /// Acceleration, m/s^2.
    pub acceleration_mps2: [f32; 3],
    /// Lower triangle of the covariance of position, velocity and acceleration, row by row.
    pub covariance: [[f32; 9]; 5],
}

impl MotionFrame {
    fn new(motion: &Motion) -> Self {
        let mut covariance = [[0.0; 9]; 5];
        let rows = motion.covariance.iter().enumerate();
        let lower = rows.flat_map(|(row, values)| values.iter().take(row + 1));
        for (slot, value) in covariance.as_flattened_mut().iter_mut().zip(lower) {
            *slot = *value;
        }
        Self {
            velocity_mps: motion.velocity_mps,
            acceleration_mps2: motion.acceleration_mps2,
            covariance,
        }
    }

    fn bits(&self) -> [u32; 51] {
        let mut bits = [0; 51];
        let values = self.velocity_mps.iter().chain(&self.acceleration_mps2);
        for (bit, value) in bits
            .iter_mut()
            .zip(values.chain(self.covariance.as_flattened()))
        {
            *bit = value.to_bits();
        }
        bits
    }
}

/// The tracker's mode on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModeCode {
    /// First measurement of a track, or the first after a long silence.
    Started,
    /// A measurement was used.
    Tracking,
    /// No measurement; the last estimates were carried on.
    Coasting,
    /// The measurement lay outside the gate.
    Rejected,
    /// Another track took over, or the filter was started anew.
    Restarted,
}

/// Memory in use on the target, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BudgetFrame {
    /// Code, constants and the blob.
    pub flash_bytes: u32,
    /// Statics, initialised or not.
    pub ram_static_bytes: u32,
    /// Deepest the stack has been since boot.
    pub stack_bytes_max: u32,
    /// What the statics leave for the stack.
    pub stack_bytes_limit: u32,
}

/// Why a request had no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RefusalCode {
    /// The bytes were no request.
    Frame,
    /// The blob in flash failed its check; only a new image helps.
    Blob,
    /// `Reset` asked for settings this blob cannot run with.
    Settings,
    /// The track was asked for something before the first accepted `Reset`.
    NotReset,
    /// `Coast`, `Forecast` or `Likelihood` before the first measurement of a track.
    NotStarted,
    /// A measured value, a standard deviation or the sensor is outside its limits, or a value that is
    /// needed is missing.
    Measurement,
    /// The same measurement as the latest one.
    Repeated,
    /// Time went back, or jumped too far ahead.
    Time,
    /// Nothing is known of the target at that time; after a coast the track was given up.
    Lost,
    /// The arithmetic gave no usable estimate.
    Numerical,
}

impl From<TrackerError> for RefusalCode {
    fn from(error: TrackerError) -> Self {
        match error {
            TrackerError::Correction(_) | TrackerError::LeftOut(_) => Self::Settings,
        }
    }
}

impl From<PassesError> for RefusalCode {
    fn from(_: PassesError) -> Self {
        Self::Settings
    }
}

impl From<StepError> for RefusalCode {
    fn from(error: StepError) -> Self {
        match error {
            StepError::Measurement(_)
            | StepError::Missing(_)
            | StepError::Sensor
            | StepError::Blunt => Self::Measurement,
            StepError::Repeated => Self::Repeated,
            StepError::TimeWentBack { .. } | StepError::TimeTooFarAhead { .. } => Self::Time,
            StepError::Lost => Self::Lost,
            StepError::NotStarted => Self::NotStarted,
            StepError::OtherModel => Self::Settings,
            StepError::NetworkNotFinite | StepError::Correction(_) => Self::Numerical,
        }
    }
}

impl core::fmt::Display for RefusalCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Frame => "the bytes were no request",
            Self::Blob => "the blob in flash failed its check",
            Self::Settings => "settings do not fit the blob",
            Self::NotReset => "no track was started",
            Self::NotStarted => "nothing was measured yet",
            Self::Measurement => "the measurement cannot be used",
            Self::Repeated => "the measurement was sent before",
            Self::Time => "time went back or jumped too far ahead",
            Self::Lost => "nothing is known of the target at that time",
            Self::Numerical => "no usable estimate came out",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{FRAME_BYTES_MAX, FrameReader, PlaceFrame, encode};

    /// Every float distinct, so that two swapped fields cannot go unseen; every varint at its longest.
    fn widest() -> [Reply; 7] {
        let row = |k: f32| [k, -k, f32::MIN_POSITIVE];
        [
            Reply::Ready(Ready {
                protocol_version: u8::MAX,
                blob_bytes: u32::MAX,
                blob_crc: u32::MAX,
            }),
            Reply::Started,
            Reply::Estimate(EstimateFrame {
                time_us: u64::MAX,
                position_m: row(1.5),
                covariance_m2: [row(2.5), row(3.5), row(4.5)],
                nis: -0.0,
                mode: ModeCode::Coasting,
                outside: true,
                manoeuvre: 0.25,
                outlier: 0.75,
                motion: Some(MotionFrame {
                    velocity_mps: row(5.5),
                    acceleration_mps2: row(6.5),
                    covariance: core::array::from_fn(|i| {
                        core::array::from_fn(|j| (9 * i + j) as f32 + 7.25)
                    }),
                }),
                ticks: u32::MAX,
            }),
            Reply::Budget(BudgetFrame {
                flash_bytes: u32::MAX,
                ram_static_bytes: u32::MAX - 1,
                stack_bytes_max: u32::MAX - 2,
                stack_bytes_limit: u32::MAX - 3,
            }),
            Reply::Refused(RefusalCode::Numerical),
            Reply::Forecast(ForecastFrame {
                places: [1.0, 2.0, 3.0].map(|k| PlaceFrame {
                    time_us: u64::MAX,
                    position_m: row(k),
                    covariance_m2: [row(k + 0.25), row(k + 0.5), row(k + 0.75)],
                    outside: true,
                }),
                ticks: u32::MAX,
            }),
            Reply::Likelihood(LikelihoodFrame {
                innovation: [Some(0.5), Some(-0.5), None, Some(1.5)],
                nis: 2.5,
                degrees: u8::MAX,
                ln_likelihood: -3.5,
                passes_gate: true,
                ticks: u32::MAX,
            }),
        ]
    }

    #[test]
    fn same_bits_sees_every_float_but_not_the_cost() {
        let Reply::Estimate(base) = widest()[2] else {
            panic!("no estimate")
        };
        let mut dearer = base;
        dearer.ticks = 1;
        assert!(base.same_bits(&dearer));
        for float in 0..66 {
            let mut other = base;
            let motion = other.motion.as_mut().expect("widest");
            let value = match float {
                0..3 => &mut other.position_m[float],
                3..12 => &mut other.covariance_m2[(float - 3) / 3][float % 3],
                12 => &mut other.nis,
                13..16 => &mut motion.velocity_mps[float - 13],
                16..19 => &mut motion.acceleration_mps2[float - 16],
                19..64 => &mut motion.covariance.as_flattened_mut()[float - 19],
                64 => &mut other.manoeuvre,
                _ => &mut other.outlier,
            };
            *value = f32::from_bits(value.to_bits() ^ 1);
            assert!(!base.same_bits(&other), "float {float}");
        }
        for (mode, outside) in [(ModeCode::Tracking, true), (ModeCode::Coasting, false)] {
            let other = EstimateFrame {
                mode,
                outside,
                ..base
            };
            assert!(!base.same_bits(&other));
        }
        let mut later = base;
        later.time_us -= 1;
        assert!(!base.same_bits(&later));
        let mut without_motion = base;
        without_motion.motion = None;
        assert!(!base.same_bits(&without_motion));
        let mut no_number = base;
        no_number.nis = f32::NAN;
        assert!(no_number.same_bits(&no_number));
        let mut positive_zero = base;
        positive_zero.nis = 0.0;
        assert!(!base.same_bits(&positive_zero));
    }

    #[test]
    fn every_reply_fits_a_frame_and_comes_back() {
        for reply in widest() {
            let frame = encode(&reply).unwrap();
            assert!(
                frame.len() <= FRAME_BYTES_MAX * 3 / 4,
                "no room left to grow"
            );
            let mut reader = FrameReader::new();
            let read: std::vec::Vec<_> = frame.iter().filter_map(|&b| reader.push(b)).collect();
            assert_eq!(read, [Ok(reply)]);
        }
    }
}
