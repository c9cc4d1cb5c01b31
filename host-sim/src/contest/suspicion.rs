//! What the firmware's tracker suspects on its way: the probabilities of its hypotheses and its mode.

use bnkf::blob::Blob;
use bnkf::{Doubt, Mode, Settings};
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::reading::Reading;

use crate::contest::track::track;
use crate::contest::tracker_filter::TrackerFilter;
use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

/// What it said of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspicion {
    /// Seconds since the flight's first sample.
    pub time_s: f64,
    /// The radar saw nothing at this sample.
    pub in_gap: bool,
    /// How the estimate came about; `None` where it refused.
    pub mode: Option<Mode>,
    /// What the reading says against the model, nothing in a gap.
    pub doubt: Doubt,
    /// How strongly the target really accelerated, m/s^2.
    pub acceleration_mps2: f64,
}

/// The suspicions of the tracker over `blob`, from the second sample of `flight` on.
///
/// # Panics
/// As [`track`].
pub fn suspicions(blob: Blob<'_>, flight: &Flight, readings: &[Option<Reading>]) -> Vec<Suspicion> {
    let mut listener = Listener {
        filter: TrackerFilter::new(blob, Settings::of(&blob)).expect("a blob's own settings fit"),
        heard: Vec::new(),
    };
    let steps = track(&mut listener, flight, readings);
    let heard = steps.into_iter().zip(listener.heard);
    heard
        .map(|(step, said)| Suspicion {
            time_s: step.time_s,
            in_gap: step.in_gap,
            mode: said.map(|(mode, _)| mode),
            doubt: said.map_or(Doubt::NONE, |(_, doubt)| doubt),
            acceleration_mps2: step.motion.acceleration_mps2,
        })
        .collect()
}

/// Writes down what no other filter could say.
struct Listener<'a> {
    filter: TrackerFilter<'a>,
    heard: Vec<Option<(Mode, Doubt)>>,
}

impl Filter for Listener<'_> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.filter.start(start)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let answer = self.filter.step(time_us, reading);
        self.heard.push(self.filter.said());
        answer
    }

    fn late(&mut self, reading: &Reading) -> Result<PositionEstimate, FilterError> {
        self.filter.late(reading)
    }

    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        self.filter.forecast(times_us)
    }
}

#[cfg(test)]
mod tests {
    use bnkf::Mode;
    use bnkf::blob::Kind;
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};

    use super::suspicions;
    use crate::contest::default_models;

    #[test]
    fn a_wrong_reading_is_suspected_when_it_comes() {
        let row = |i: i32| {
            let t = f64::from(i) * 0.1;
            [t, 20.0 + 5.0 * t.cos(), 5.0 * t.sin(), 10.0]
        };
        let rows: Vec<_> = (0..60).map(row).collect();
        let flight = Flight::from_track("circle", "circle", &rows).unwrap();
        let settings =
            RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, SamplingRate::FULL, 3);
        let mut readings = sample_radar(&flight, &settings);
        readings[20] = None;
        readings[40].as_mut().unwrap().range_m += 60.0;
        let models = default_models::load().unwrap();
        let mut blobs = models.iter().map(|model| model.blob());
        let blob = blobs.find(|blob| blob.kind() == Kind::Recursive).unwrap();
        let all = suspicions(blob, &flight, &readings);
        assert_eq!(all.len(), 59);
        let most = all
            .iter()
            .max_by(|a, b| a.doubt.outlier.total_cmp(&b.doubt.outlier));
        assert!((most.unwrap().time_s - 4.0).abs() < 1e-9, "{most:?}");
        assert!(most.unwrap().doubt.outlier > 0.9, "{most:?}");
        assert_eq!((all[19].mode, all[19].in_gap), (Some(Mode::Coasting), true));
        assert!((all[10].acceleration_mps2 - 5.0).abs() < 0.2);
    }
}
