//! Settings of a tracker out of Python's arguments.

use bnkf::blob::field::PASSES_MAX;
use bnkf::{Correction, Inference, Settings};
use pyo3::prelude::*;

use crate::error::SettingsError;
use crate::model::Model;

/// The model's own settings but for what is given.
pub fn settings(
    model: &Model,
    inference: Option<&Bound<'_, PyAny>>,
    frozen_spreads: bool,
    correction: Option<&str>,
    seed: u64,
) -> PyResult<Settings> {
    let own = Settings::of(model.decoded().blob());
    let inference = inference.map_or(Ok(own.inference), asked)?;
    let correction = match correction {
        None => own.correction,
        Some("none") => Correction::None,
        Some("converted") => Correction::Converted,
        Some("polar") => Correction::Polar,
        Some(other) => {
            let said = format!("correction: {other:?} is not one");
            return Err(SettingsError::new_err(said));
        }
    };
    let inference = match inference {
        Inference::Passes(_) if frozen_spreads => inference.frozen(),
        _ if frozen_spreads => {
            let said = "frozen_spreads: without passes there is nothing to freeze";
            return Err(SettingsError::new_err(said));
        }
        as_it_is => as_it_is,
    };
    Ok(Settings {
        correction,
        inference,
        seed,
    })
}

/// "mean", "moments", or a number of passes.
fn asked(given: &Bound<'_, PyAny>) -> PyResult<Inference> {
    if let Ok(passes) = given.extract::<i64>() {
        // No number of passes is zero: it stands for all that are out of range.
        let inference = Inference::of_passes(u16::try_from(passes).unwrap_or(0));
        return inference.map_err(|_| {
            let said = format!("passes: {passes} is not in 1..={PASSES_MAX}");
            SettingsError::new_err(said)
        });
    }
    match given.extract::<&str>() {
        Ok("mean") => Ok(Inference::Mean),
        Ok("moments") => Ok(Inference::Moments),
        _ => {
            let given = given.repr()?;
            let said =
                format!("inference: {given} is not \"mean\", \"moments\" or a number of passes");
            Err(SettingsError::new_err(said))
        }
    }
}
