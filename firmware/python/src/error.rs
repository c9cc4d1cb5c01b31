//! The crate's errors as exceptions with its text.

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, create_exception};

create_exception!(
    bnkf,
    BnkfError,
    PyValueError,
    "What the tracker refuses; the text says what and why."
);
create_exception!(
    bnkf,
    ModelError,
    BnkfError,
    "The bytes are no model that this version runs."
);
create_exception!(
    bnkf,
    SettingsError,
    BnkfError,
    "A setting that does not exist, or does not fit the model."
);
create_exception!(
    bnkf,
    StepError,
    BnkfError,
    "A step, coast, forecast or likelihood that was refused; the tracker is as before."
);
create_exception!(
    bnkf,
    TrackBytesError,
    BnkfError,
    "The bytes are no track, or one of another kind than the model."
);

/// A model's.
pub fn model(error: bnkf::blob::BlobError) -> PyErr {
    ModelError::new_err(error.to_string())
}

/// A step's.
pub fn step(error: bnkf::StepError) -> PyErr {
    StepError::new_err(error.to_string())
}
