//! What must be true of every estimate that leaves the firmware's tracker.

use bnkf::call::Call;
use bnkf::estimate::{Doubt, Estimate, Mode, Motion};
use bnkf::recursive::correction::GATE_NIS;
use bnkf::recursive::mixture::SUSPECT_GATE_NIS;
use nalgebra::{Matrix3, SMatrix};

/// Whether every number is finite.
#[must_use]
pub fn is_finite(estimate: &Estimate) -> bool {
    let numbers = |motion: &Motion| {
        let vectors = motion.velocity_mps.iter().chain(&motion.acceleration_mps2);
        vectors
            .chain(motion.covariance.as_flattened())
            .all(|x| x.is_finite())
    };
    estimate.position_m.iter().all(|x| x.is_finite())
        && estimate
            .covariance_m2
            .as_flattened()
            .iter()
            .all(|x| x.is_finite())
        && estimate.nis.is_finite()
        && estimate.doubt.manoeuvre.is_finite()
        && estimate.doubt.outlier.is_finite()
        && estimate.motion.as_ref().is_none_or(numbers)
}

/// Whether the covariances (three by three, nine by nine) are symmetric and positive definite, for
/// whoever factorises them in double or in single precision.
#[must_use]
pub fn is_definite(estimate: &Estimate) -> bool {
    let c = &estimate.covariance_m2;
    let position = Matrix3::from_fn(|i, j| c[i][j]);
    let motion = |motion: &Motion| {
        let full = SMatrix::<f32, 9, 9>::from_fn(|i, j| motion.covariance[i][j]);
        full == full.transpose()
            && full.cholesky().is_some()
            && full.map(f64::from).cholesky().is_some()
    };
    position == position.transpose()
        && position.cholesky().is_some()
        && position.map(f64::from).cholesky().is_some()
        && estimate.motion.as_ref().is_none_or(motion)
}

/// Whether mode and time say what happened: a coast coasts, a step does not; a rejected measurement
/// lay outside the gate, a suspect's at least, and one that was tracked with did not; only a first track
/// is started from nothing; and without a measurement doubt grows.
#[must_use]
pub fn is_true(call: &Call, estimate: &Estimate, before: Option<&Estimate>) -> bool {
    is_doubt_true(estimate) && is_mode_true(call, estimate, before)
}

/// Whether doubts are probabilities, and only a measurement that was weighed has any: a rejected one is
/// wrong for sure, and one that a track began with or was taken over by is not.
fn is_doubt_true(estimate: &Estimate) -> bool {
    let doubt = estimate.doubt;
    match estimate.mode {
        Mode::Rejected => doubt == Doubt::OUTLIER,
        Mode::Tracking => {
            // Shares sum to one to rounding.
            let possible = 0.0..=1.000_001;
            possible.contains(&doubt.manoeuvre)
                && possible.contains(&doubt.outlier)
                && possible.contains(&(doubt.manoeuvre + doubt.outlier))
        }
        Mode::Started | Mode::Coasting | Mode::Restarted => doubt == Doubt::NONE,
    }
}

fn is_mode_true(call: &Call, estimate: &Estimate, before: Option<&Estimate>) -> bool {
    let recursive = estimate.motion.is_some();
    let gate = GATE_NIS as f32;
    let sigma2 = |e: &Estimate| {
        (0..3)
            .map(|i| f64::from(e.covariance_m2[i][i]))
            .sum::<f64>()
    };
    match call {
        Call::Coast(time_us) => {
            let elapsed_s = before.map_or(0.0, |before| {
                time_us.saturating_sub(before.time_us) as f64 * 1e-6
            });
            // Ten seconds later the least agile target may be metres away.
            estimate.mode == Mode::Coasting
                && estimate.time_us == *time_us
                && estimate.nis == 0.0
                && before.is_some()
                && (elapsed_s < 10.0 || sigma2(estimate) > 1.0)
        }
        Call::Step(measurement) => {
            estimate.time_us == measurement.time_us
                && match estimate.mode {
                    Mode::Coasting => false,
                    Mode::Started => estimate.nis == 0.0 || !recursive,
                    Mode::Tracking => before.is_some() && (estimate.nis < gate || !recursive),
                    Mode::Rejected | Mode::Restarted => before.is_some() && recursive,
                }
                && (estimate.mode != Mode::Rejected || estimate.nis >= SUSPECT_GATE_NIS)
        }
    }
}
