//! What a tracker returns.

/// Largest normalised innovation squared that is told apart from larger ones.
pub const NIS_MAX: f32 = 1e9;

/// Standard deviation of a position component, m, beyond which nothing is known of a target: a
/// hundred kilometres.
pub const POSITION_SIGMA_MAX_M: f32 = 1e5;

/// How an [`Estimate`] came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Mode {
    /// From the first measurement, or the first one after a long silence.
    Started,
    /// From the current measurement and the ones before it.
    Tracking,
    /// Without a measurement: extrapolated, with a covariance that grows.
    Coasting,
    /// The measurement lay outside the gate and was not used.
    Rejected,
    /// Another track took over, because measurements that the old one rejected agree with each
    /// other; or the filter was started anew from the measurement, its state being lost.
    Restarted,
}

impl Mode {
    /// Its name in tables and in other languages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Tracking => "tracking",
            Self::Coasting => "coasting",
            Self::Rejected => "rejected",
            Self::Restarted => "restarted",
        }
    }
}

/// What a recursive tracker knows beside the position; frame as in [`Estimate`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motion {
    /// Velocity, m/s.
    pub velocity_mps: [f32; 3],
    /// Acceleration, m/s^2.
    pub acceleration_mps2: [f32; 3],
    /// Covariance of position, velocity and acceleration, three rows each.
    pub covariance: [[f32; 9]; 9],
}

/// How probable it is, after the measurement, that the target or the sensor did what the model does
/// not expect of them. A memoryless blob has no such probabilities: they are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Doubt {
    /// Probability that the target manoeuvred.
    pub manoeuvre: f32,
    /// Probability that the reading is wrong; one if it was rejected.
    pub outlier: f32,
}

impl Doubt {
    /// Nothing is known against the model.
    pub const NONE: Self = Self {
        manoeuvre: 0.0,
        outlier: 0.0,
    };
    /// A reading that was rejected.
    pub const OUTLIER: Self = Self {
        manoeuvre: 0.0,
        outlier: 1.0,
    };
}

/// Position and covariance at one instant; x east, y north, z up, origin as in
/// the measurements.
///
/// ```
/// use bnkf::{Doubt, Estimate, Mode, Motion};
///
/// fn log(estimate: &Estimate) {
///     let [x, y, z] = estimate.position_m;
///     match estimate.mode {
///         Mode::Rejected => println!("the reading was not the target's: {:?}", estimate.doubt),
///         mode => println!("{mode:?} at {x} {y} {z}"),
///     }
///     let Doubt { manoeuvre, .. } = estimate.doubt;
///     if manoeuvre > 0.9 {
///         println!("it turns, or brakes");
///     }
///     // A recursive model's; a memoryless one has none.
///     if let Some(Motion { velocity_mps, .. }) = estimate.motion {
///         println!("moves at {velocity_mps:?}");
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate {
    /// Time, microseconds, of the measurement or of the call to coast.
    pub time_us: u64,
    /// Position, m.
    pub position_m: [f32; 3],
    /// Covariance of the position, m^2, symmetric positive definite.
    pub covariance_m2: [[f32; 3]; 3],
    /// Normalised innovation squared of the correction, at most [`NIS_MAX`]; zero without one.
    pub nis: f32,
    /// How the estimate came about.
    pub mode: Mode,
    /// Whether the target is where, or moves as, the model was not trained for: its answer is then
    /// less to be relied on, whether the network was asked or not. A memoryless blob does not know, and says no.
    pub outside: bool,
    /// What the measurement says against the model.
    pub doubt: Doubt,
    /// Velocity, acceleration and the full covariance; a memoryless tracker has none.
    pub motion: Option<Motion>,
}

impl Estimate {
    /// Room for one; nothing is known.
    pub(crate) const NONE: Self = Self {
        time_us: 0,
        position_m: [0.0; 3],
        covariance_m2: [[0.0; 3]; 3],
        nis: 0.0,
        mode: Mode::Coasting,
        outside: false,
        doubt: Doubt::NONE,
        motion: None,
    };
}

/// What a step made of its measurement; with the state it left, an [`Estimate`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    pub nis: f32,
    pub mode: Mode,
    pub doubt: Doubt,
}

impl Outcome {
    /// Without a correction.
    pub const fn uncorrected(mode: Mode) -> Self {
        Self {
            nis: 0.0,
            mode,
            doubt: Doubt::NONE,
        }
    }
}
