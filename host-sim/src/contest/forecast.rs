//! What a filter says, on its way, of the times ahead.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::scoring::horizons::Ahead;

use crate::contest::track::{TrackStep, score_or_hold, watched_track};
use crate::filter::Filter;
use crate::scoring::forecast::ScoredForecast;

/// Runs `filter` over `flight` as [`track`](super::track::track) does and asks it after every fifth
/// sample where the target will be at the horizons that lie inside the flight.
///
/// The truth is the flight's, interpolated. Where there is no usable forecast the last usable estimate
/// is scored in its place, as a divergence.
///
/// # Panics
/// As [`track`](super::track::track).
pub fn track_ahead(
    filter: &mut dyn Filter,
    flight: &Flight,
    readings: &[Option<Reading>],
) -> (Vec<TrackStep>, Vec<ScoredForecast>) {
    let mut forecasts = Vec::new();
    let steps = watched_track(filter, flight, readings, &mut |filter, number, held| {
        let Some(ahead) = Ahead::of(flight, number) else {
            return;
        };
        let answers = filter.forecast(&ahead.times_us);
        for (horizon, truth_m) in ahead.truths_m.into_iter().enumerate() {
            let answer = answers.map(|answers| answers[horizon]);
            let (_, scored) = score_or_hold(&answer, held, &truth_m.into());
            forecasts.push(ScoredForecast {
                horizon,
                score: scored.score,
                diverged: scored.diverged,
            });
        }
    });
    (steps, forecasts)
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::reading::Reading;
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};
    use bnkf_model_export::scoring::horizons::EVERY;
    use nalgebra::{Matrix3, Vector3};

    use super::track_ahead;
    use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

    /// Stays where it is, and refuses every second forecast.
    struct Stubborn {
        asked: usize,
    }

    fn here(x: f64) -> PositionEstimate {
        PositionEstimate::new(Vector3::new(x, 0.0, 5.0), Matrix3::identity() * 4.0)
    }

    impl Filter for Stubborn {
        fn start(&mut self, _: &Start<'_>) -> Result<PositionEstimate, FilterError> {
            Ok(here(0.0))
        }

        fn step(&mut self, _: u64, _: Option<&Reading>) -> Result<PositionEstimate, FilterError> {
            Ok(here(0.0))
        }

        fn forecast(
            &mut self,
            times_us: &[u64; HORIZONS_US.len()],
        ) -> Result<Forecasts, FilterError> {
            self.asked += 1;
            if self.asked.is_multiple_of(2) {
                return Err(FilterError::NotFinite);
            }
            // A metre behind the target, which flies at 2 m/s.
            Ok(times_us.map(|time_us| here(2e-6 * time_us as f64 - 1.0)))
        }
    }

    #[test]
    fn horizons_inside_the_flight_are_scored_by_hand() {
        let rows: Vec<_> = (0..31)
            .map(|i| [0.1 * f64::from(i), 0.2 * f64::from(i), 0.0, 5.0])
            .collect();
        let flight = Flight::from_track("line", "line", &rows).unwrap();
        let radar =
            RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, SamplingRate::FULL, 1);
        let readings = sample_radar(&flight, &radar);
        let mut filter = Stubborn { asked: 0 };
        let (steps, forecasts) = track_ahead(&mut filter, &flight, &readings);
        assert_eq!(steps.len(), 30);
        // Three seconds: at 0.5 and 1 s all three, at 1.5 and 2 s two, at 2.5 s one, at 3 s none.
        assert_eq!((filter.asked, 30 / EVERY), (5, 6));
        let horizons: Vec<_> = forecasts.iter().map(|own| own.horizon).collect();
        assert_eq!(horizons, [0, 1, 2, 0, 1, 2, 0, 1, 0, 1, 0]);
        let near = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-6, "{got}");
        for own in &forecasts[..3] {
            assert!(!own.diverged);
            near(own.score.error_m, 1.0);
            near(own.score.mahalanobis_squared, 0.25);
        }
        // Refused at 1 s: where it was, 0 m, against 3, 4 and 6 m.
        for (own, truth_m) in forecasts[3..6].iter().zip([3.0, 4.0, 6.0]) {
            assert!(own.diverged);
            near(own.score.error_m, truth_m);
        }
    }
}
