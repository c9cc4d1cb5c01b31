//! The estimates of a whole flight.

use std::collections::BTreeMap;

use bnkf::{Call, Estimate, Settings, StepError, Track, Workspace};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods as _, PyFixedUnicode};
use pyo3::prelude::*;

use crate::error::SettingsError;
use crate::model::Model;
use crate::readings::calls;
use crate::settings::settings;

/// A mode's name as an element of an array: dtype "<U9".
type Name = PyFixedUnicode<9>;
/// Stands for the mode of a row that was refused.
const REFUSED: &str = "refused";

/// What a tracker said to each of a flight's readings, as arrays with a row for every reading. Floats are float32,
/// and NaN in rows that were refused.
#[pyclass(frozen, get_all, module = "bnkf")]
pub struct Estimates {
    /// Times, microseconds; shape (n,), uint64.
    time_us: Py<PyArray1<u64>>,
    /// Positions, m; shape (n, 3).
    position_m: Py<PyArray2<f32>>,
    /// Their covariances, m^2; shape (n, 3, 3).
    covariance_m2: Py<PyArray3<f32>>,
    /// Velocities, m/s; shape (n, 3), NaN of a memoryless model.
    velocity_mps: Py<PyArray2<f32>>,
    /// Normalised innovations squared; shape (n,), zero without a correction.
    nis: Py<PyArray1<f32>>,
    /// How they came about, as Estimate.mode says, or "refused"; shape (n,).
    mode: Py<PyAny>,
    /// Whether the target is where, or moves as, the model was not trained for; shape (n,), bool.
    outside: Py<PyArray1<bool>>,
    /// Probabilities that the target manoeuvred; shape (n,).
    manoeuvre: Py<PyArray1<f32>>,
    /// Probabilities that the reading is wrong; shape (n,).
    outlier: Py<PyArray1<f32>>,
    /// Why readings were refused, by their row.
    refused: BTreeMap<usize, String>,
}

#[pymethods]
impl Estimates {
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.time_us.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (rows, refused) = (self.__len__(py)?, self.refused.len());
        Ok(format!("Estimates({rows} rows, {refused} refused)"))
    }
}

/// Tracks a whole flight, without holding the interpreter's lock: other threads run meanwhile.
///
/// readings: an array of shape (n, 9) or (n, 15) whose columns are COLUMNS in their order, or a structured array with
/// columns of these names (others are ignored). A channel that is NaN was not measured; a row without any asks for an
/// estimate in a gap. Without the columns of the sensor it is in the origin and at rest. Rows that the tracker refuses
/// are named in `refused`, and it goes on. Settings are those of Tracker. Raises SettingsError, and ValueError for
/// an array that holds no readings.
#[pyfunction]
#[pyo3(signature = (model, readings, inference=None, *, frozen_spreads=false, correction=None, seed=1))]
pub fn track(
    py: Python<'_>,
    model: &Bound<'_, Model>,
    readings: &Bound<'_, PyAny>,
    inference: Option<&Bound<'_, PyAny>>,
    frozen_spreads: bool,
    correction: Option<&str>,
    seed: u64,
) -> PyResult<Estimates> {
    let model = model.get();
    let settings = settings(model, inference, frozen_spreads, correction, seed)?;
    let calls = calls(readings)?;
    let said = py
        .detach(|| run(model, settings, &calls))
        .map_err(|e| SettingsError::new_err(e.to_string()))?;
    said.arrays(py)
}

/// The columns while they are filled.
#[derive(Default)]
struct Said {
    time_us: Vec<u64>,
    position_m: Vec<f32>,
    covariance_m2: Vec<f32>,
    velocity_mps: Vec<f32>,
    nis: Vec<f32>,
    mode: Vec<&'static str>,
    outside: Vec<bool>,
    manoeuvre: Vec<f32>,
    outlier: Vec<f32>,
    refused: BTreeMap<usize, String>,
}

fn run(model: &Model, settings: Settings, calls: &[Call]) -> Result<Said, bnkf::TrackerError> {
    let model = model.decoded();
    let mut track = Track::new(model, settings)?;
    let mut workspace = Workspace::new();
    let mut said = Said::default();
    for call in calls {
        let answer = match call {
            Call::Step(measurement) => track.step(model, &mut workspace, measurement),
            Call::Coast(time_us) => track.coast(model, &mut workspace, *time_us),
        };
        said.push(call.time_us(), &answer);
    }
    Ok(said)
}

impl Said {
    fn push(&mut self, time_us: u64, answer: &Result<Estimate, StepError>) {
        if let Err(error) = answer {
            self.refused.insert(self.time_us.len(), error.to_string());
        }
        let estimate = answer.as_ref().ok();
        let number = |of: fn(&Estimate) -> f32| estimate.map_or(f32::NAN, of);
        let motion = estimate.and_then(|estimate| estimate.motion.as_ref());
        self.time_us.push(time_us);
        self.position_m
            .extend(estimate.map_or([f32::NAN; 3], |e| e.position_m));
        self.covariance_m2.extend(
            estimate
                .map_or([[f32::NAN; 3]; 3], |e| e.covariance_m2)
                .as_flattened(),
        );
        self.velocity_mps
            .extend(motion.map_or([f32::NAN; 3], |m| m.velocity_mps));
        self.nis.push(number(|e| e.nis));
        self.mode.push(estimate.map_or(REFUSED, |e| e.mode.name()));
        self.outside.push(estimate.is_some_and(|e| e.outside));
        self.manoeuvre.push(number(|e| e.doubt.manoeuvre));
        self.outlier.push(number(|e| e.doubt.outlier));
    }

    fn arrays(self, py: Python<'_>) -> PyResult<Estimates> {
        fn column<T: Element>(py: Python<'_>, numbers: Vec<T>) -> Py<PyArray1<T>> {
            PyArray::from_vec(py, numbers).unbind()
        }
        let rows = self.time_us.len();
        let vectors = |numbers| PyArray::from_vec(py, numbers).reshape([rows, 3]);
        let covariances = PyArray::from_vec(py, self.covariance_m2).reshape([rows, 3, 3])?;
        let modes = self.mode.into_iter().map(name).collect();
        Ok(Estimates {
            time_us: column(py, self.time_us),
            position_m: vectors(self.position_m)?.unbind(),
            covariance_m2: covariances.unbind(),
            velocity_mps: vectors(self.velocity_mps)?.unbind(),
            nis: column(py, self.nis),
            mode: column::<Name>(py, modes).into_any(),
            outside: column(py, self.outside),
            manoeuvre: column(py, self.manoeuvre),
            outlier: column(py, self.outlier),
            refused: self.refused,
        })
    }
}

fn name(mode: &str) -> Name {
    let mut letters = ['\0'; 9];
    for (letter, of) in letters.iter_mut().zip(mode.chars()) {
        *letter = of;
    }
    letters.map(u32::from).into()
}
