//! One estimate.

use bnkf::Motion;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// Position and covariance at one instant; x east, y north, z up. Arrays are float32.
#[pyclass(frozen, module = "bnkf")]
#[derive(Clone)]
pub struct Estimate(pub bnkf::Estimate);

/// How probable it is, after the measurement, that the target or the sensor did what the model does not
/// expect of them. Zero for a memoryless model.
#[pyclass(frozen, module = "bnkf")]
#[derive(Clone)]
pub struct Doubt(bnkf::Doubt);

#[pymethods]
impl Doubt {
    /// Probability that the target manoeuvred.
    #[getter]
    fn manoeuvre(&self) -> f32 {
        self.0.manoeuvre
    }

    /// Probability that the reading is wrong; one if it was rejected.
    #[getter]
    fn outlier(&self) -> f32 {
        self.0.outlier
    }

    fn __repr__(&self) -> String {
        let bnkf::Doubt { manoeuvre, outlier } = self.0;
        format!("Doubt(manoeuvre={manoeuvre}, outlier={outlier})")
    }
}

#[pymethods]
impl Estimate {
    /// Time, microseconds, of the measurement, coast or forecast.
    #[getter]
    fn time_us(&self) -> u64 {
        self.0.time_us
    }

    /// Position, m; shape (3,).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.0.position_m)
    }

    /// Covariance of the position, m^2; shape (3, 3), positive definite.
    #[getter]
    fn covariance_m2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        PyArray2::from_owned_array(py, numpy::ndarray::arr2(&self.0.covariance_m2))
    }

    /// Velocity, m/s; shape (3,), or None of a memoryless model.
    #[getter]
    fn velocity_mps<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f32>>> {
        self.motion(|motion| PyArray1::from_slice(py, &motion.velocity_mps))
    }

    /// Acceleration, m/s^2; shape (3,), or None of a memoryless model.
    #[getter]
    fn acceleration_mps2<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f32>>> {
        self.motion(|motion| PyArray1::from_slice(py, &motion.acceleration_mps2))
    }

    /// Covariance of position, velocity and acceleration, three rows each; shape (9, 9), or None of a memoryless
    /// model.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f32>>> {
        let array = |motion: &Motion| numpy::ndarray::arr2(&motion.covariance);
        self.motion(|motion| PyArray2::from_owned_array(py, array(motion)))
    }

    /// Normalised innovation squared of the correction; zero without one.
    #[getter]
    fn nis(&self) -> f32 {
        self.0.nis
    }

    /// How it came about: "started", "tracking", "coasting", "rejected" or "restarted".
    #[getter]
    fn mode(&self) -> &'static str {
        self.0.mode.name()
    }

    /// Whether the target is where, or moves as, the model was not trained for.
    #[getter]
    fn outside(&self) -> bool {
        self.0.outside
    }

    /// What the measurement says against the model.
    #[getter]
    fn doubt(&self) -> Doubt {
        Doubt(self.0.doubt)
    }

    fn __repr__(&self) -> String {
        let Self(estimate) = self;
        let (time_us, mode) = (estimate.time_us, estimate.mode.name());
        let position = estimate.position_m;
        format!("Estimate(time_us={time_us}, mode={mode:?}, position_m={position:?})")
    }
}

impl Estimate {
    fn motion<T>(&self, of: impl FnOnce(&Motion) -> T) -> Option<T> {
        self.0.motion.as_ref().map(of)
    }
}
