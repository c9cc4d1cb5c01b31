//! Estimates.

use crate::estimate::{Estimate, Mode};

/// How an estimate came about.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BnkfMode {
    /// From the first measurement, or the first one after a long silence.
    Started = 0,
    /// From the current measurement and the ones before it.
    Tracking = 1,
    /// Without a measurement.
    Coasting = 2,
    /// The measurement lay outside the gate and was not used.
    Rejected = 3,
    /// Another track took over, or the filter was started anew.
    Restarted = 4,
}

/// Position and covariance at one instant; x east, y north, z up.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BnkfEstimate {
    /// Time, microseconds.
    pub time_us: u64,
    /// Position, m.
    pub position_m: [f32; 3],
    /// Covariance of the position, m^2, symmetric positive definite.
    pub covariance_m2: [[f32; 3]; 3],
    /// Normalised innovation squared of the correction; zero without one.
    pub nis: f32,
    /// Probability that the target manoeuvred.
    pub manoeuvre: f32,
    /// Probability that the reading is wrong; one if it was rejected.
    pub outlier: f32,
    /// Velocity, m/s; of a recursive model.
    pub velocity_mps: [f32; 3],
    /// Acceleration, m/s^2; of a recursive model.
    pub acceleration_mps2: [f32; 3],
    /// Covariance of position, velocity and acceleration, three rows each; of a recursive model.
    pub covariance: [[f32; 9]; 9],
    /// How it came about.
    pub mode: BnkfMode,
    /// Whether the target is where, or moves as, the model was not trained for.
    pub outside: bool,
    /// Whether there are velocity, acceleration and their covariance; they are zero for a memoryless model.
    pub has_motion: bool,
}

impl From<&Estimate> for BnkfEstimate {
    fn from(estimate: &Estimate) -> Self {
        let motion = estimate.motion.as_ref();
        Self {
            time_us: estimate.time_us,
            position_m: estimate.position_m,
            covariance_m2: estimate.covariance_m2,
            nis: estimate.nis,
            manoeuvre: estimate.doubt.manoeuvre,
            outlier: estimate.doubt.outlier,
            velocity_mps: motion.map_or([0.0; 3], |motion| motion.velocity_mps),
            acceleration_mps2: motion.map_or([0.0; 3], |motion| motion.acceleration_mps2),
            covariance: motion.map_or([[0.0; 9]; 9], |motion| motion.covariance),
            mode: match estimate.mode {
                Mode::Started => BnkfMode::Started,
                Mode::Tracking => BnkfMode::Tracking,
                Mode::Coasting => BnkfMode::Coasting,
                Mode::Rejected => BnkfMode::Rejected,
                Mode::Restarted => BnkfMode::Restarted,
            },
            outside: estimate.outside,
            has_motion: motion.is_some(),
        }
    }
}
