//! One target's tracker.

use bnkf::{TRACK_SNAPSHOT_BYTES, Track, Workspace};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::{self, SettingsError, TrackBytesError};
use crate::estimate::Estimate;
use crate::likelihood::Likelihood;
use crate::measurement::{Channel, measurement};
use crate::model::Model;
use crate::settings::settings;

/// Estimates the position of one target from its radar measurements.
///
/// inference: None for the model's own, "mean", "moments", or a number of Monte Carlo passes (1 is "mean").
/// frozen_spreads: passes draw with frozen spreads, which is faster. correction: None for the one of the model's
/// kind; "none", "converted" or "polar" of a memoryless one. seed: of the passes. Raises SettingsError.
#[pyclass(module = "bnkf")]
pub struct Tracker {
    model: Model,
    workspace: Box<Workspace>,
    track: Track,
}

#[pymethods]
impl Tracker {
    #[new]
    #[pyo3(signature = (model, inference=None, *, frozen_spreads=false, correction=None, seed=1))]
    fn new(
        model: &Bound<'_, Model>,
        inference: Option<&Bound<'_, PyAny>>,
        frozen_spreads: bool,
        correction: Option<&str>,
        seed: u64,
    ) -> PyResult<Self> {
        let model = model.get().clone();
        let settings = settings(&model, inference, frozen_spreads, correction, seed)?;
        let track = Track::new(model.decoded(), settings)
            .map_err(|e| SettingsError::new_err(e.to_string()))?;
        Ok(Self::of(model, track))
    }

    /// The estimate at the time of a measurement. A channel is (value, sigma), or None if it was not measured: range (m),
    /// elevation, azimuth (rad), range-rate (m/s). The sensor is in the origin and at rest unless its position (m) and
    /// velocity (m/s) are given. Raises StepError; the measurement is then ignored.
    #[pyo3(signature = (time_us, range=None, elevation=None, azimuth=None, range_rate=None, sensor_position_m=None, sensor_velocity_mps=None))]
    #[allow(clippy::too_many_arguments)]
    fn step(
        &mut self,
        time_us: u64,
        range: Channel,
        elevation: Channel,
        azimuth: Channel,
        range_rate: Channel,
        sensor_position_m: Option<[f64; 3]>,
        sensor_velocity_mps: Option<[f64; 3]>,
    ) -> PyResult<Estimate> {
        let channels = [range, elevation, azimuth, range_rate];
        let plot = measurement(time_us, channels, sensor_position_m, sensor_velocity_mps);
        let model = self.model.decoded();
        let estimate = self.track.step(model, &mut self.workspace, &plot);
        estimate.map(Estimate).map_err(error::step)
    }

    /// The estimate at a time without a measurement; the covariance grows. Raises StepError.
    fn coast(&mut self, time_us: u64) -> PyResult<Estimate> {
        let model = self.model.decoded();
        let estimate = self.track.coast(model, &mut self.workspace, time_us);
        estimate.map(Estimate).map_err(error::step)
    }

    /// Where the target will be at each of the times, which lie in order; the track stays as it is. Raises StepError.
    fn forecast(&mut self, times_us: Vec<u64>) -> PyResult<Vec<Estimate>> {
        let model = self.model.decoded();
        let mut forecasts = Vec::with_capacity(times_us.len());
        self.track
            .forecast_each(model, &mut self.workspace, &times_us, |_, estimate| {
                forecasts.push(Estimate(*estimate));
            })
            .map_err(error::step)?;
        Ok(forecasts)
    }

    /// How well a measurement, given as to step, fits the track, which stays as it is. Raises StepError.
    #[pyo3(signature = (time_us, range=None, elevation=None, azimuth=None, range_rate=None, sensor_position_m=None, sensor_velocity_mps=None))]
    #[allow(clippy::too_many_arguments)]
    fn likelihood(
        &mut self,
        time_us: u64,
        range: Channel,
        elevation: Channel,
        azimuth: Channel,
        range_rate: Channel,
        sensor_position_m: Option<[f64; 3]>,
        sensor_velocity_mps: Option<[f64; 3]>,
    ) -> PyResult<Likelihood> {
        let channels = [range, elevation, azimuth, range_rate];
        let plot = measurement(time_us, channels, sensor_position_m, sensor_velocity_mps);
        let model = self.model.decoded();
        let likelihood = self.track.likelihood(model, &mut self.workspace, &plot);
        likelihood.map(Likelihood).map_err(error::step)
    }

    /// Forgets the target and all times, and starts the random stream again.
    fn reset(&mut self) {
        self.track.reset();
    }

    /// Time of the latest step or coast, microseconds, or None.
    #[getter]
    fn latest_us(&self) -> Option<u64> {
        self.track.latest_us()
    }

    /// All that is known of the target, to the bit: what the firmware writes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
        self.track.to_bytes(&mut bytes);
        PyBytes::new(py, &bytes)
    }

    /// Goes on with what to_bytes, or a microcontroller, wrote; also on another model of its kind, which then begins
    /// without what the first one's network noted for itself. Raises TrackBytesError.
    #[staticmethod]
    fn from_bytes(model: &Bound<'_, Model>, data: &[u8]) -> PyResult<Self> {
        let model = model.get().clone();
        let bytes: &[u8; TRACK_SNAPSHOT_BYTES] = data.try_into().map_err(|_| {
            let length = data.len();
            TrackBytesError::new_err(format!(
                "{length} bytes; a track has {TRACK_SNAPSHOT_BYTES}"
            ))
        })?;
        let refused = |said: String| TrackBytesError::new_err(said);
        let mut track = Track::from_bytes(bytes).map_err(|e| refused(e.to_string()))?;
        track
            .hand_over(model.decoded())
            .map_err(|e| refused(e.to_string()))?;
        Ok(Self::of(model, track))
    }

    fn __repr__(&self) -> String {
        format!(
            "Tracker({}, latest_us={:?})",
            self.model.__repr__(),
            self.latest_us()
        )
    }
}

impl Tracker {
    fn of(model: Model, track: Track) -> Self {
        Self {
            model,
            workspace: Box::new(Workspace::new()),
            track,
        }
    }
}
