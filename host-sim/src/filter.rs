//! What every method under test does: take one reading at a time, answer with a position.

use bnkf_model_export::radar::reading::Reading;
pub use bnkf_model_export::scoring::horizons::HORIZONS_US;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Forecasts at every one of [`HORIZONS_US`], or at other times as many.
pub type Forecasts = [PositionEstimate; HORIZONS_US.len()];

/// What a filter knows when a flight begins.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// The flight's first reading; its time is the filter's time.
    pub reading: &'a Reading,
    /// True position, m. Only the paper's set-up reads it, to start its EKF and UKF at the truth.
    pub true_position_m: Vector3<f64>,
    /// True velocity, m/s; see [`Start::true_position_m`].
    pub true_velocity_mps: Vector3<f64>,
}

/// Normalised innovation squared of one correction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nis {
    /// `y' S^-1 y`, no unit: chi-square distributed if the filter is consistent.
    pub value: f64,
    /// Degrees of freedom of that distribution.
    pub degrees: usize,
}

/// What a filter with a gate made of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fate {
    /// It was used.
    Used,
    /// It lay outside the gate and was not used.
    Rejected,
    /// With it another track took over, or the filter started anew.
    Restarted,
}

impl Fate {
    /// Name in results.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Rejected => "rejected",
            Self::Restarted => "restarted",
        }
    }
}

/// Where a filter believes the target to be at the time it was asked about.
///
/// Frame: x east, y north, z up, the flights' own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionEstimate {
    /// Position, m.
    pub position_m: Vector3<f64>,
    /// Covariance of the position, m^2.
    pub covariance_m2: Matrix3<f64>,
    /// Consistency of the reading with the prediction, whether it was used or rejected; `None` in a gap, at a start and
    /// for methods that do not predict.
    pub nis: Option<Nis>,
    /// What became of the reading; `None` in a gap and for methods without a gate, which use all.
    pub fate: Option<Fate>,
    /// The method says that the target is where, or moves as, it was not trained for; the firmware's
    /// recursive tracker alone knows, see [`bnkf::Estimate::outside`].
    pub outside: bool,
}

impl PositionEstimate {
    /// An estimate of a method that does not predict and refuses nothing: a position, m, and its covariance, m^2.
    pub fn new(position_m: Vector3<f64>, covariance_m2: Matrix3<f64>) -> Self {
        Self {
            position_m,
            covariance_m2,
            nis: None,
            fate: None,
            outside: false,
        }
    }

    /// Whether its innovation, if there is one, is below `limit`.
    pub fn nis_is_below(&self, limit: f64) -> bool {
        self.nis.is_none_or(|nis| nis.value < limit)
    }
}

/// Why a filter has no estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilterError {
    /// `step` came before `start`.
    #[error("the filter was not started")]
    NotStarted,
    /// A time lies before its predecessor.
    #[error("time went back")]
    TimeWentBack,
    /// The estimate is NaN or infinite.
    #[error("the estimate is not finite")]
    NotFinite,
    /// A covariance has no Cholesky factor.
    #[error("a covariance is not positive definite")]
    NotPositiveDefinite,
    /// A reading lacks what the method cannot do without.
    #[error("{0} was not measured")]
    Missing(bnkf::measurement::Channel),
    /// The file of a method that answered before has no such estimate.
    #[error("the file has no estimate of this time")]
    NotInFile,
    /// The firmware's tracker refused.
    #[error("{0}")]
    Tracker(bnkf::StepError),
}

/// A method under test. It sees the readings in order and nothing of the future.
pub trait Filter {
    /// Forgets everything and begins a flight.
    ///
    /// # Errors
    /// The first reading cannot be used.
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError>;

    /// Moves to `time_us` (the clock of the first reading) and, unless this is a gap, takes in
    /// the reading of that time.
    ///
    /// # Errors
    /// There is no usable estimate for this time. The filter may be asked again later: one that
    /// cannot recover keeps returning errors.
    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError>;

    /// Takes in a reading that comes after the step of its time, at most
    /// [`LATE_MAX_US`](bnkf::late::LATE_MAX_US) behind the last one; the estimate at the last step's time.
    ///
    /// # Errors
    /// It is too late, or there is no usable estimate. A method that has no way to take one leaves it out.
    fn late(&mut self, _reading: &Reading) -> Result<PositionEstimate, FilterError> {
        Err(FilterError::TimeWentBack)
    }

    /// Where the target will be at `times_us`, in order and not before the last step, by the filter's
    /// own model and without a reading. What it says of later readings does not change.
    ///
    /// # Errors
    /// There is no usable forecast.
    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError>;
}
