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

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;

    use super::*;
    use crate::contest::default_models;
    use crate::exchange::plots::{Plot, Target};
    use crate::exchange::tracked;
    use bnkf::Settings;

    /// A target at rest; errors of its readings have `factor` times the stated standard deviations.
    fn answers(factor: f64) -> Vec<Answer> {
        asked((0..120).map(|step| plot(step, factor)).collect())
    }

    fn plot(step: u64, factor: f64) -> Plot {
        let error = |step: u64, channel: u64| {
            // As far up as down, of variance one.
            let share = ((7 * step + 3 * channel) % 12) as f64;
            factor * (share - 5.5) / 3.452
        };
        Plot {
            line: step + 2,
            time_us: 100_000 * step,
            reading: (step % 6 != 5).then(|| Reading {
                time_us: 100_000 * step,
                range_m: 35.0 + 0.5 * error(step, 0),
                elevation_rad: 0.3 + 0.01 * error(step, 1),
                azimuth_rad: 0.7 + 0.01 * error(step, 2),
                range_rate_mps: 0.1 * error(step, 3),
                sigma_range_m: 0.5,
                sigma_elevation_rad: 0.01,
                sigma_azimuth_rad: 0.01,
                sigma_range_rate_mps: 0.1,
                sensor: Pose::ORIGIN,
                late_us: 0,
            }),
        }
    }

    fn asked(plots: Vec<Plot>) -> Vec<Answer> {
        let target = Target {
            name: "a".to_owned(),
            plots,
        };
        let model = default_models::recursive().unwrap();
        tracked::run(&model, Settings::of(&model.blob()), &target).unwrap()
    }

    #[test]
    fn errors_twice_as_large_as_stated_are_seen_without_a_truth() {
        let [honest, twice] =
            [1.0, 2.5].map(|factor| SelfConsistency::of(&answers(factor)).unwrap());
        assert_eq!(honest.readings, 99);
        assert!(honest.ratio < honest.region.1, "{honest}");
        assert!(twice.ratio > twice.region.1, "{twice}");
        // Chi-square of four degrees passes 13.277 once in a hundred (Abramowitz and Stegun, table 26.8).
        let all = answers(2.5);
        let far = all
            .iter()
            .filter_map(Answer::nis)
            .filter(|nis| nis.value > 13.277);
        assert_eq!(twice.far, far.count() as f64 / twice.readings as f64);
        assert!(twice.far > 0.01 && honest.far < 0.01, "{honest}; {twice}");
        assert!(twice.to_string().contains("surer than the readings allow"));
        // The sum of 99 innovations of four numbers: deviation sqrt(2 / 396).
        let deviation = (2.0_f64 / 396.0).sqrt();
        assert!((honest.region.1 - 1.0 - 1.96 * deviation).abs() < 0.01);
        assert_eq!(modes(&answers(1.0)), "1 started, 99 tracking, 20 coasting");
    }

    #[test]
    fn an_answer_to_a_late_reading_is_not_counted_again() {
        let mut plots: Vec<Plot> = (0..5).map(|step| plot(step, 1.0)).collect();
        plots.swap(3, 4);
        let answers = asked(plots);
        let counted: Vec<bool> = answers
            .iter()
            .map(|answer| answer.nis().is_some())
            .collect();
        assert_eq!(counted, [false, true, true, true, false]);
        assert!(answers.iter().all(|answer| answer.estimate.is_ok()));
    }

    #[test]
    fn nothing_is_said_of_no_innovation() {
        assert_eq!(SelfConsistency::of(&answers(1.0)[..1]), None);
    }

    /// As the page has it: a name that is markup stays text, and every coordinate is a number.
    #[test]
    fn the_picture_is_sound() {
        let picture = crate::plot::track_figure::draw("<b>", &answers(1.0));
        assert!(picture.contains("Track of &lt;b&gt;") && !picture.contains("<b>"));
        assert!(!picture.contains("NaN") && !picture.contains("inf"));
        let nobody = crate::plot::track_figure::draw("", &[]);
        assert!(!nobody.contains("NaN"));
    }
}
