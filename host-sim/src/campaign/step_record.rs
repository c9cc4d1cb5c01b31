//! What is kept of one scored step.

use bnkf_model_export::flights::flight::Motion;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::scoring::step_score::StepScore;
use serde::{Deserialize, Serialize};

use crate::contest::track::TrackStep;
use crate::contest::tuned_on::TunedOn;
use crate::filter::{Fate, Nis};
use crate::method::Method;
use crate::scoring::cell::ScoredStep;
use crate::scoring::forecast::ScoredForecast;
use crate::scoring::phase::Phase;

/// One scored step of one method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Seconds since the flight's first sample.
    pub time_s: f64,
    /// The radar saw nothing.
    pub in_gap: bool,
    /// The estimate was unusable; the scores are those of the last usable one.
    pub diverged: bool,
    /// What became of the reading; `None` without one and for methods without a gate.
    pub fate: Option<Fate>,
    /// The flight was not tracked; see [`crate::contest::loss`].
    pub not_tracked: bool,
    /// The method was not trained for this, by its own word.
    pub outside: bool,
    /// Euclidean distance to the truth, metres.
    pub error_m: f64,
    /// Squared Mahalanobis distance.
    pub mahalanobis_squared: f64,
    /// Determinant of the position covariance, m^6.
    pub det_p_m6: f64,
    /// Normalised innovation squared and its degrees of freedom.
    pub nis: Option<(f64, u8)>,
    /// How the target really moved.
    pub motion: Motion,
}

/// What a method said at one step, kept where it is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateRecord {
    /// Position that was scored, metres: x, y, z.
    pub position_m: [f64; 3],
    /// Its covariance, m^2: xx, xy, xz, yy, yz, zz.
    pub covariance_m2: [f64; 6],
}

/// The steps of one method over one flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodSteps {
    /// The method.
    pub method: Method,
    /// What its parameters were fitted to, if it has any.
    pub tuned_on: Option<TunedOn>,
    /// From the second sample on.
    pub steps: Vec<StepRecord>,
    /// The estimates of the steps, or nothing where they are not asked for.
    pub estimates: Vec<EstimateRecord>,
    /// What it said, on its way, of the times ahead.
    pub forecasts: Vec<ScoredForecast>,
}

impl MethodSteps {
    /// Whether these are the steps of `method` with the parameters of `tuned_on`.
    pub fn is_of(&self, method: Method, tuned_on: Option<TunedOn>) -> bool {
        (self.method, self.tuned_on) == (method, tuned_on)
    }
}

impl From<&TrackStep> for StepRecord {
    fn from(step: &TrackStep) -> Self {
        let StepScore {
            error_m,
            mahalanobis_squared,
            det_p_m6,
        } = step.scored.score;
        Self {
            time_s: step.time_s,
            in_gap: step.in_gap,
            diverged: step.scored.diverged,
            fate: step.scored.fate,
            not_tracked: step.scored.not_tracked,
            outside: step.scored.outside,
            error_m,
            mahalanobis_squared,
            det_p_m6,
            nis: step.nis.map(|nis| (nis.value, nis.degrees as u8)),
            motion: step.motion,
        }
    }
}

impl From<&TrackStep> for EstimateRecord {
    fn from(step: &TrackStep) -> Self {
        let c = &step.covariance_m2;
        Self {
            position_m: step.position_m.into(),
            covariance_m2: [
                c[(0, 0)],
                c[(0, 1)],
                c[(0, 2)],
                c[(1, 1)],
                c[(1, 2)],
                c[(2, 2)],
            ],
        }
    }
}

impl StepRecord {
    /// What the method did at this step, whose sample has such a `reading`: `held` (its estimate was refused or
    /// unusable, the last one stands in its place), `coasting` (nothing had come), `rejected`, `restarted`, else
    /// `tracking`.
    pub fn mode(&self, reading: Option<&Reading>) -> &'static str {
        let has_come = reading.is_some_and(|reading| reading.late_us == 0);
        match self.fate {
            _ if self.diverged => "held",
            _ if !has_come => "coasting",
            Some(fate @ (Fate::Rejected | Fate::Restarted)) => fate.label(),
            Some(Fate::Used) | None => "tracking",
        }
    }

    /// Its part in a cell of the table.
    pub fn scored(&self) -> ScoredStep {
        ScoredStep {
            score: StepScore {
                error_m: self.error_m,
                mahalanobis_squared: self.mahalanobis_squared,
                det_p_m6: self.det_p_m6,
            },
            diverged: self.diverged,
            fate: self.fate,
            not_tracked: self.not_tracked,
            outside: self.outside,
        }
    }

    /// The innovation of a reading that the method used, where it has one: what a gate kept out tells nothing of how
    /// honest the method's own innovations are.
    pub fn nis_used(&self) -> Option<Nis> {
        let (value, degrees) = self.nis.filter(|_| self.fate != Some(Fate::Rejected))?;
        Some(Nis {
            value,
            degrees: usize::from(degrees),
        })
    }

    /// Where in its flight it lies.
    pub fn phase(&self) -> Phase {
        Phase::of(self.time_s, self.in_gap)
    }
}

#[cfg(test)]
impl StepRecord {
    /// A step of a still target that is as far off as it says, one of a track that goes on.
    pub fn of_test(time_s: f64, error_m: f64) -> Self {
        Self {
            time_s,
            in_gap: false,
            diverged: false,
            fate: None,
            not_tracked: false,
            outside: false,
            error_m,
            mahalanobis_squared: 3.0,
            det_p_m6: 1.0,
            nis: None,
            motion: Motion::default(),
        }
    }
}
