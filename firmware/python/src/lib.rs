//! The Python module `bnkf`: the firmware's tracker, with the same bits.
//!
//! `bnkf.pyi` says what users see, with units and frames.

mod error;
mod estimate;
mod estimates;
mod likelihood;
mod measurement;
mod model;
mod readings;
mod settings;
mod tracker;

/// Bayesian neural Kalman tracking for radar nodes: the firmware's own code, the same bits.
///
/// Frame and units everywhere: x east, y north, z up, the radar at the origin unless a measurement says
/// otherwise; azimuth from +x towards +y, elevation from the horizontal, range-rate positive outbound;
/// metres, radians, metres per second, times in microseconds. Numbers are float32 inside; float64 that come in
/// are rounded to the nearest.
#[pyo3::pymodule(name = "bnkf")]
mod module {
    #[pymodule_export]
    use crate::error::{BnkfError, ModelError, SettingsError, StepError, TrackBytesError};
    #[pymodule_export]
    use crate::estimate::{Doubt, Estimate};
    #[pymodule_export]
    use crate::estimates::{Estimates, track};
    #[pymodule_export]
    use crate::likelihood::Likelihood;
    #[pymodule_export]
    use crate::model::Model;
    #[pymodule_export]
    use crate::tracker::Tracker;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let columns = crate::readings::COLUMNS;
        module.add("COLUMNS", pyo3::types::PyTuple::new(module.py(), columns)?)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
