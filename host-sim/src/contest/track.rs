//! One filter over one flight: an estimate and its score for every sample.

use bnkf_model_export::flights::flight::{Flight, Motion};
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::time_us;
use bnkf_model_export::scoring::step_score::StepScore;
use nalgebra::{Matrix3, Vector3};

use crate::baseline::sensor::cartesian;
use crate::contest::loss::Loss;
use crate::filter::{Filter, FilterError, Nis, PositionEstimate, Start};
use crate::scoring::cell::ScoredStep;

/// What a filter said about one sample of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackStep {
    /// Seconds since the flight's first sample.
    pub time_s: f64,
    /// The estimate that was scored: the last usable one if this step diverged.
    pub position_m: Vector3<f64>,
    /// Its covariance, m^2.
    pub covariance_m2: Matrix3<f64>,
    /// Consistency of the reading with the prediction, where the filter tells.
    pub nis: Option<Nis>,
    /// Its score.
    pub scored: ScoredStep,
    /// The radar saw nothing at this sample.
    pub in_gap: bool,
    /// How the target really moved.
    pub motion: Motion,
}

/// Runs `filter` over `flight` and scores every sample but the first, which only starts it.
///
/// A reading that comes late is no reading at its own sample; the filter gets it before the first sample
/// that is not earlier than it comes, and every sample is scored with what had come by then.
///
/// A refused or unusable estimate is a divergence: the last usable estimate is scored in its
/// place. Before any there is the first reading's place with its range sigma on every axis, zeros
/// and a metre where it has none.
///
/// # Panics
/// If `readings` has not one entry per sample or the first sample was not measured.
pub fn track(
    filter: &mut dyn Filter,
    flight: &Flight,
    readings: &[Option<Reading>],
) -> Vec<TrackStep> {
    watched_track(filter, flight, readings, &mut |_, _, _| {})
}

/// Who looks at a filter after each step, whose sample's number and estimate that is scored it gets.
pub type Watcher<'a> = &'a mut dyn FnMut(&mut dyn Filter, usize, &PositionEstimate);

/// [`track`] with somebody who looks.
///
/// # Panics
/// As [`track`].
pub fn watched_track(
    filter: &mut dyn Filter,
    flight: &Flight,
    readings: &[Option<Reading>],
    watcher: Watcher<'_>,
) -> Vec<TrackStep> {
    assert_eq!(
        readings.len(),
        flight.samples.len(),
        "one reading or gap per sample"
    );
    let first = readings[0].as_ref().expect("the first sample is measured");
    let mut held = place_of(first);
    let start = Start {
        reading: first,
        true_position_m: flight.samples[0].position_m.into(),
        true_velocity_mps: flight.samples[0].velocity_mps.into(),
    };
    // A filter that cannot start answers its steps with errors, which are counted below.
    if let Ok(estimate) = filter.start(&start)
        && StepScore::new(
            &estimate.position_m,
            &estimate.covariance_m2,
            &start.true_position_m,
        )
        .is_ok()
    {
        held = estimate;
    }
    let mut loss = Loss::default();
    let mut steps = Vec::with_capacity(readings.len() - 1);
    let truth = flight.samples.iter().zip(flight.motion());
    let mut late: Vec<&Reading> = readings
        .iter()
        .flatten()
        .filter(|r| r.late_us > 0)
        .collect();
    late.sort_by_key(|reading| reading.time_us + reading.late_us);
    let mut late = late.into_iter().peekable();
    for (number, ((sample, motion), reading)) in truth.zip(readings).enumerate().skip(1) {
        let truth_m = sample.position_m.into();
        let now_us = time_us(flight, sample.time_s);
        while let Some(came) = late.next_if(|r| r.time_us + r.late_us <= now_us) {
            // One that is refused is one reading less, as any other; the next step tells.
            filter.late(came).ok();
        }
        let on_time = reading.as_ref().filter(|reading| reading.late_us == 0);
        let answer = filter.step(now_us, on_time);
        let (estimate, mut scored) = score_or_hold(&answer, &held, &truth_m);
        scored.not_tracked = loss.step(&answer, !scored.diverged);
        held = estimate;
        steps.push(TrackStep {
            time_s: sample.time_s,
            position_m: estimate.position_m,
            covariance_m2: estimate.covariance_m2,
            nis: answer.ok().and_then(|estimate| estimate.nis),
            scored,
            in_gap: reading.is_none(),
            motion,
        });
        watcher(filter, number, &held);
    }
    steps
}

/// The score of an answer, or of what was `held` if there is no usable one: then it has diverged.
pub(super) fn score_or_hold(
    answer: &Result<PositionEstimate, FilterError>,
    held: &PositionEstimate,
    truth_m: &Vector3<f64>,
) -> (PositionEstimate, ScoredStep) {
    let score = |estimate: &PositionEstimate| {
        StepScore::new(&estimate.position_m, &estimate.covariance_m2, truth_m)
    };
    if let Ok(estimate) = answer
        && let Ok(score) = score(estimate)
    {
        let scored = ScoredStep {
            fate: estimate.fate,
            outside: estimate.outside,
            ..ScoredStep::tracked(score)
        };
        return (*estimate, scored);
    }
    // The held estimate scored at an earlier truth, so only an overflow could stop it here; then
    // the largest number says what infinity would.
    let score = score(held).unwrap_or(StepScore {
        error_m: f64::MAX,
        mahalanobis_squared: f64::MAX,
        det_p_m6: held.covariance_m2.determinant(),
    });
    (
        *held,
        ScoredStep {
            diverged: true,
            ..ScoredStep::tracked(score)
        },
    )
}

/// The reading in Cartesian coordinates, with its range sigma on every axis; what it lacks counts as zero.
fn place_of(reading: &Reading) -> PositionEstimate {
    let [elevation, azimuth, range, _] = reading.vectors().measured;
    PositionEstimate::new(
        cartesian(elevation, azimuth, range) + Vector3::from(reading.sensor.position_m),
        Matrix3::identity() * reading.vectors().sigmas[2].powi(2),
    )
}

/// The reading's position in Cartesian coordinates, metres.
pub fn position_of(reading: &Reading) -> Vector3<f64> {
    cartesian(reading.elevation_rad, reading.azimuth_rad, reading.range_m)
        + Vector3::from(reading.sensor.position_m)
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar, sample_radars};
    use nalgebra::{Matrix3, Vector3};

    use super::track;
    use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

    /// Answers what it is told to, whatever it sees.
    struct Script {
        start: Result<PositionEstimate, FilterError>,
        answers: Vec<Result<PositionEstimate, FilterError>>,
    }

    impl Filter for Script {
        fn start(&mut self, _: &Start<'_>) -> Result<PositionEstimate, FilterError> {
            self.start
        }

        fn step(&mut self, _: u64, _: Option<&Reading>) -> Result<PositionEstimate, FilterError> {
            self.answers.remove(0)
        }

        fn forecast(&mut self, _: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
            Err(FilterError::NotFinite)
        }
    }

    fn at(x: f64, variance_m2: f64) -> PositionEstimate {
        PositionEstimate {
            position_m: Vector3::new(x, 0.0, 5.0),
            covariance_m2: Matrix3::identity() * variance_m2,
            nis: None,
            fate: None,
            outside: x > 3.0,
        }
    }

    /// Ten samples along x at 1 m a step, every other one measured.
    fn flight() -> (Flight, Vec<Option<Reading>>) {
        let rows: Vec<_> = (0..6)
            .map(|i| [f64::from(i), f64::from(i), 0.0, 5.0])
            .collect();
        let flight = Flight::from_track("line", "line", &rows).unwrap();
        let settings =
            RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, SamplingRate::FULL, 1);
        let mut readings = sample_radar(&flight, &settings);
        readings[3] = None;
        (flight, readings)
    }

    #[test]
    fn divergences_hold_the_last_usable_estimate_and_are_counted() {
        let (flight, readings) = flight();
        let mut script = Script {
            start: Ok(at(0.0, 4.0)),
            answers: vec![
                Err(FilterError::NotFinite),
                Ok(at(2.5, 1.0)),
                Ok(at(f64::NAN, 1.0)),
                Ok(at(4.0, -1.0)),
                Ok(at(5.0, 1.0)),
            ],
        };
        let steps = track(&mut script, &flight, &readings);
        let errors: Vec<_> = steps.iter().map(|step| step.scored.score.error_m).collect();
        assert_eq!(errors, [1.0, 0.5, 0.5, 1.5, 0.0]);
        let diverged: Vec<_> = steps.iter().map(|step| step.scored.diverged).collect();
        assert_eq!(diverged, [true, false, true, true, false]);
        let not_tracked = steps.iter().map(|step| step.scored.not_tracked);
        assert!(not_tracked.eq(diverged));
        assert_eq!(steps[0].scored.score.mahalanobis_squared, 0.25);
        let outside: Vec<_> = steps.iter().map(|step| step.scored.outside).collect();
        assert_eq!(outside, [false, false, false, false, true]);
        let gaps: Vec<_> = steps.iter().map(|step| step.in_gap).collect();
        assert_eq!(gaps, [false, false, true, false, false]);
        let one_mps = |step: &super::TrackStep| step.motion.speed_mps == 1.0;
        assert!(steps.iter().all(one_mps));
    }

    #[test]
    fn a_filter_that_never_starts_is_scored_at_the_first_reading() {
        let settings =
            RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, SamplingRate::FULL, 1);
        for radar_m in [[0.0; 3], [-20.0, 30.0, 2.0]] {
            let (flight, _) = flight();
            let readings = sample_radars(&flight, &settings, |_, _| Pose::at(radar_m));
            let mut script = Script {
                start: Err(FilterError::NotFinite),
                answers: vec![Err(FilterError::NotStarted); 5],
            };
            let steps = track(&mut script, &flight, &readings);
            assert!(steps.iter().all(|step| step.scored.diverged));
            // The first reading has an error of a metre or so; the target moves five metres away.
            let last = steps[4].scored.score.error_m;
            assert!((last - 5.0).abs() < 4.0, "{radar_m:?} {last}");
            assert_eq!(steps[4].covariance_m2, Matrix3::identity());
        }
    }
}
