//! Settings of a tracker out of Python's arguments.

use bnkf::{Correction, Inference, Settings};
use pyo3::prelude::*;

use crate::error::SettingsError;
use crate::model::Model;

/// How the network is asked.
#[derive(FromPyObject)]
pub enum Asked {
    /// So many passes.
    Passes(u16),
    /// "mean" or "moments".
    Named(String),
}

/// The model's own settings but for what is given.
pub fn settings(
    model: &Model,
    inference: Option<Asked>,
    frozen_spreads: bool,
    correction: Option<&str>,
    seed: u64,
) -> PyResult<Settings> {
    let own = Settings::of(model.decoded().blob());
    let unknown = |what, given| SettingsError::new_err(format!("{what}: {given:?} is not one"));
    let inference = match inference {
        None => own.inference,
        Some(Asked::Passes(passes)) => {
            Inference::of_passes(passes).map_err(|e| SettingsError::new_err(e.to_string()))?
        }
        Some(Asked::Named(name)) => match name.as_str() {
            "mean" => Inference::Mean,
            "moments" => Inference::Moments,
            _ => return Err(unknown("inference", &name)),
        },
    };
    let correction = match correction {
        None => own.correction,
        Some("none") => Correction::None,
        Some("converted") => Correction::Converted,
        Some("polar") => Correction::Polar,
        Some(other) => return Err(unknown("correction", &other.to_owned())),
    };
    let inference = if frozen_spreads {
        inference.frozen()
    } else {
        inference
    };
    Ok(Settings {
        correction,
        inference,
        seed,
    })
}
