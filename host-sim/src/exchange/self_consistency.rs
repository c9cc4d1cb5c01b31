//! Whether a tracker's innovations are what it says, where no truth is known.
//!
//! Of a consistent filter the normalised innovations squared are independent and chi-square distributed, so
//! their sum over `n` readings is, too, with the sum of their degrees of freedom (Bar-Shalom, Li and
//! Kirubarajan, Estimation with Applications, section 5.4.2). It says nothing of what the readings do not show:
//! gaps, and errors of the radar that all readings share.

use super::tracked::Answer;
use crate::scoring::chi_square;
use bnkf::Mode;

/// Ends of the 95 % region.
const ENDS: (f64, f64) = (0.025, 0.975);
/// Share of readings of a consistent filter above the line.
const FAR: f64 = 0.01;

/// Innovations of one target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfConsistency {
    /// Readings that met a prediction.
    pub readings: usize,
    /// Mean of the NIS over the degrees of freedom: 1 is honest, more is too sure.
    pub ratio: f64,
    /// Where 95 % of consistent filters have it.
    pub region: (f64, f64),
    /// Share of readings beyond the 99 % quantile of their own distribution.
    pub far: f64,
}

impl SelfConsistency {
    /// Of a target's answers; `None` if no reading met a prediction.
    pub fn of(answers: &[Answer]) -> Option<Self> {
        let all: Vec<_> = answers.iter().filter_map(Answer::nis).collect();
        let degrees: usize = all.iter().map(|nis| nis.degrees).sum();
        if degrees == 0 {
            return None;
        }
        let degrees = degrees as f64;
        let sum: f64 = all.iter().map(|nis| nis.value).sum();
        let limit = |at: usize| chi_square::quantile(1.0 - FAR, at as f64);
        // One to four channels, or none of a reading that is not one.
        let limits = [0, 1, 2, 3, 4].map(|at| if at == 0 { f64::INFINITY } else { limit(at) });
        let far = all
            .iter()
            .filter(|nis| nis.value > limits[nis.degrees.min(4)])
            .count();
        Some(Self {
            readings: all.len(),
            ratio: sum / degrees,
            region: (
                chi_square::quantile(ENDS.0, degrees) / degrees,
                chi_square::quantile(ENDS.1, degrees) / degrees,
            ),
            far: far as f64 / all.len() as f64,
        })
    }
}

impl std::fmt::Display for SelfConsistency {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            readings,
            ratio,
            region,
            far,
        } = self;
        let said = if *ratio > region.1 {
            "surer than the readings allow"
        } else if *ratio < region.0 {
            "less sure than it could be"
        } else {
            "consistent"
        };
        write!(
            f,
            "{readings} innovations, NIS per degree of freedom {ratio:.2} ({said}; 95 % of consistent filters {:.2} to {:.2}), {:.1} % beyond the 99 % limit",
            region.0,
            region.1,
            100.0 * far
        )
    }
}

/// How often each mode was answered, in words; refusals at the end.
pub fn modes(answers: &[Answer]) -> String {
    let all = [
        Mode::Started,
        Mode::Tracking,
        Mode::Coasting,
        Mode::Rejected,
        Mode::Restarted,
    ];
    let count = |wanted: Mode| {
        let own = answers
            .iter()
            .filter_map(|answer| answer.estimate.as_ref().ok());
        own.filter(|estimate| estimate.mode == wanted).count()
    };
    let refused = answers
        .iter()
        .filter(|answer| answer.estimate.is_err())
        .count();
    let mut said: Vec<String> = Vec::new();
    for wanted in all {
        let count = count(wanted);
        if count > 0 {
            said.push(format!("{count} {}", wanted.name()));
        }
    }
    if refused > 0 {
        said.push(format!("{refused} refused"));
    }
    said.join(", ")
}
