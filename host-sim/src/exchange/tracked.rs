//! What the firmware's tracker says of plots without a truth beside them.

use bnkf::{Estimate, LateTracker, Measurement, Settings, StepError, Tracker, TrackerError};

use super::plots::{Plot, Target};
use crate::contest::model::Model;
use crate::contest::tracker_filter::nis_of;
use crate::csv_text::number;
use crate::filter::Nis;

/// Answer to one plot.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// The plot.
    pub plot: Plot,
    /// What the tracker said.
    pub estimate: Result<Estimate, StepError>,
}

/// A plot that the tracker refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {cause}")]
pub struct Refusal {
    /// Its line in the file.
    pub line: u64,
    /// Why.
    pub cause: StepError,
}

impl Refusal {
    /// Of an answer that is one.
    pub fn of(answer: &Answer) -> Option<Self> {
        let cause = answer.estimate.err()?;
        let line = answer.plot.line;
        Some(Self { line, cause })
    }
}

/// Columns of the table of answers. Units stand in the names.
pub const HEADER: [&str; 22] = [
    "flight",
    "line",
    "time_us",
    "x_m",
    "y_m",
    "z_m",
    "xx_m2",
    "xy_m2",
    "xz_m2",
    "yy_m2",
    "yz_m2",
    "zz_m2",
    "vx_mps",
    "vy_mps",
    "vz_mps",
    "nis",
    "nis_degrees",
    "mode",
    "outside",
    "manoeuvre",
    "wrong_reading",
    "refused",
];

/// Runs a tracker over everything that was said of a target, in the order in which it came.
///
/// # Errors
/// The settings do not fit to the model.
pub fn run(
    model: &Model,
    settings: Settings,
    target: &Target,
) -> Result<Vec<Answer>, TrackerError> {
    let mut tracker = LateTracker::new(Tracker::new(model.blob(), settings)?);
    let answer = |plot: &Plot| Answer {
        plot: *plot,
        estimate: match &plot.reading {
            Some(reading) => tracker.step(&Measurement::from(reading)),
            None => tracker.coast(plot.time_us),
        },
    };
    Ok(target.plots.iter().map(answer).collect())
}

impl Answer {
    /// Normalised innovation squared, where a reading met a prediction. What is answered to a late one is of
    /// the newest time, and so is its NIS: that one was counted already.
    pub fn nis(&self) -> Option<Nis> {
        let estimate = self.estimate.as_ref().ok()?;
        let reading = self.plot.reading.as_ref()?;
        if estimate.time_us != self.plot.time_us {
            return None;
        }
        nis_of(estimate, reading)
    }

    /// A row of the table.
    pub fn row(&self, flight: &str) -> Vec<String> {
        let mut row = vec![
            flight.to_owned(),
            self.plot.line.to_string(),
            self.plot.time_us.to_string(),
        ];
        match &self.estimate {
            Err(error) => {
                row.resize(HEADER.len() - 1, String::new());
                row.push(error.to_string());
            }
            Ok(estimate) => {
                let p = estimate.covariance_m2;
                row.extend(estimate.position_m.map(|x| number(f64::from(x))));
                let upper = [p[0][0], p[0][1], p[0][2], p[1][1], p[1][2], p[2][2]];
                row.extend(upper.map(|x| number(f64::from(x))));
                let velocity = estimate.motion.map(|motion| motion.velocity_mps);
                let velocity = velocity.map(|v| v.map(|x| number(f64::from(x))));
                row.extend(velocity.unwrap_or_default());
                let nis = self.nis();
                row.push(nis.map_or(String::new(), |nis| number(nis.value)));
                row.push(nis.map_or(String::new(), |nis| nis.degrees.to_string()));
                row.push(estimate.mode.name().to_owned());
                row.push(estimate.outside.to_string());
                row.push(number(f64::from(estimate.doubt.manoeuvre)));
                row.push(number(f64::from(estimate.doubt.outlier)));
                row.push(String::new());
            }
        }
        row
    }
}
