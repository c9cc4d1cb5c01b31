//! How well a plot fits a track.

use numpy::PyArray1;
use pyo3::prelude::*;

/// What a track says of a measurement, for associating plots with tracks.
#[pyclass(frozen, module = "bnkf")]
#[derive(Clone)]
pub struct Likelihood(pub bnkf::Likelihood);

#[pymethods]
impl Likelihood {
    /// Measured less expected: elevation, azimuth (rad), range (m), range-rate (m/s); shape (4,), float32, NaN where
    /// nothing was measured or the model expects nothing.
    #[getter]
    fn innovation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        let numbers = self.0.innovation.map(|y| y.unwrap_or(f32::NAN));
        PyArray1::from_slice(py, &numbers)
    }

    /// Normalised innovation squared.
    #[getter]
    fn nis(&self) -> f32 {
        self.0.nis
    }

    /// Degrees of freedom of the NIS.
    #[getter]
    fn degrees(&self) -> u8 {
        self.0.degrees
    }

    /// Natural logarithm of the density, per rad^2 m m/s or what is there of them.
    #[getter]
    fn ln_likelihood(&self) -> f32 {
        self.0.ln_likelihood
    }

    /// Whether the gate would pass the measurement.
    #[getter]
    fn passes_gate(&self) -> bool {
        self.0.passes_gate
    }

    fn __repr__(&self) -> String {
        let (ln, nis) = (self.0.ln_likelihood, self.0.nis);
        format!("Likelihood(ln_likelihood={ln}, nis={nis})")
    }
}
