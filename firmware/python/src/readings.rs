//! A flight's readings out of a NumPy array.

use bnkf::Call;
use numpy::{PyArrayDyn, PyArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict as _;

use crate::measurement::measurement;

/// Columns of readings in order, as `host-sim readings` names them.
pub const COLUMNS: [&str; 15] = [
    "time_us",
    "range_m",
    "elevation_rad",
    "azimuth_rad",
    "range_rate_mps",
    "sigma_range_m",
    "sigma_elevation_rad",
    "sigma_azimuth_rad",
    "sigma_range_rate_mps",
    "sensor_x_m",
    "sensor_y_m",
    "sensor_z_m",
    "sensor_vx_mps",
    "sensor_vy_mps",
    "sensor_vz_mps",
];
/// Columns without the sensor's.
const WITHOUT_SENSOR: usize = 9;
/// Every whole number below it is one in double precision, microseconds: 285 years.
const TIME_US_MAX: f64 = (1_u64 << 53) as f64;

type Row = [f64; COLUMNS.len()];

/// What a tracker is asked, row by row.
///
/// # Errors
/// `ValueError` names shape, column or row.
pub fn calls(readings: &Bound<'_, PyAny>) -> PyResult<Vec<Call>> {
    // A data frame's columns have names, which an array of it would not.
    let frame: Option<Vec<String>> = match readings.getattr_opt("columns")? {
        Some(columns) => columns
            .try_iter()?
            .map(|name| name?.extract())
            .collect::<PyResult<_>>()
            .ok(),
        None => None,
    };
    let rows = if let Some(names) = frame {
        named(readings, &names)?
    } else {
        let readings = doubles(readings, "asanyarray", None)?;
        if masked(&readings)? {
            let said = "readings: a masked array: fill what is masked with nan";
            return Err(PyValueError::new_err(said));
        }
        let names: Option<Vec<String>> = readings.getattr("dtype")?.getattr("names")?.extract()?;
        match names {
            Some(names) => named(&readings, &names)?,
            None => plain(&readings)?,
        }
    };
    rows.iter()
        .enumerate()
        .map(|(i, row)| call(i, row))
        .collect()
}

/// `numpy.FUNCTION(object, dtype=...)`.
fn doubles<'py>(
    object: &Bound<'py, PyAny>,
    function: &str,
    dtype: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = object.py();
    let keywords = [("dtype", dtype)].into_py_dict(py)?;
    py.import("numpy")?
        .getattr(function)?
        .call((object,), Some(&keywords))
}

/// Whether its numbers are not all meant, which an array of doubles would not know.
fn masked(array: &Bound<'_, PyAny>) -> PyResult<bool> {
    let module = array.py().import("numpy.ma")?;
    module.call_method1("isMaskedArray", (array,))?.extract()
}

/// Shape and numbers, row by row.
fn numbers(array: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f64>)> {
    let array = doubles(array, "ascontiguousarray", Some("float64"))?;
    let array = array.cast_into::<PyArrayDyn<f64>>()?.readonly();
    let view = array.as_array();
    Ok((view.shape().to_vec(), view.iter().copied().collect()))
}

/// Rows of an array with named columns; of those that are missing nothing was measured, and the sensor is
/// at rest in the origin.
fn named(readings: &Bound<'_, PyAny>, names: &[String]) -> PyResult<Vec<Row>> {
    let mut rows = Vec::new();
    for (place, column) in COLUMNS.into_iter().enumerate() {
        if !names.iter().any(|name| name == column) {
            if place == 0 {
                return Err(PyValueError::new_err("readings: no column time_us"));
            }
            continue;
        }
        let (shape, column) = numbers(&readings.get_item(column)?)?;
        if shape.len() != 1 {
            let said = format!("readings: shape {shape:?} of named columns is not (n,)");
            return Err(PyValueError::new_err(said));
        }
        rows.resize(column.len(), NOTHING);
        for (row, number) in rows.iter_mut().zip(column) {
            row[place] = number;
        }
    }
    Ok(rows)
}

/// Nothing was measured, from a sensor at rest in the origin.
const NOTHING: Row = {
    let mut row = [f64::NAN; COLUMNS.len()];
    let mut place = WITHOUT_SENSOR;
    while place < row.len() {
        row[place] = 0.0;
        place += 1;
    }
    row
};

/// Rows of a plain array.
fn plain(readings: &Bound<'_, PyAny>) -> PyResult<Vec<Row>> {
    let (shape, numbers) = numbers(readings)?;
    let columns = match *shape.as_slice() {
        [_, columns @ (WITHOUT_SENSOR | 15)] => columns,
        _ => {
            let said = format!("readings: shape {shape:?} is neither (n, 9) nor (n, 15)");
            return Err(PyValueError::new_err(said));
        }
    };
    let row = |given: &[f64]| {
        let mut row = NOTHING;
        row[..columns].copy_from_slice(given);
        row
    };
    Ok(numbers.chunks_exact(columns).map(row).collect())
}

/// A step, or a coast where no channel was measured.
fn call(place: usize, row: &Row) -> PyResult<Call> {
    let [time_us, rest @ ..] = *row;
    if !(0.0..TIME_US_MAX).contains(&time_us) || time_us.fract() != 0.0 {
        let said =
            format!("readings: row {place}: time_us {time_us} is no whole number below 2^53");
        return Err(PyValueError::new_err(said));
    }
    let time_us = time_us as u64;
    let channel = |i: usize| (!rest[i].is_nan()).then_some((rest[i], rest[i + 4]));
    let channels = [0, 1, 2, 3].map(channel);
    if channels.iter().all(Option::is_none) {
        return Ok(Call::Coast(time_us));
    }
    let three = |i: usize| Some([rest[i], rest[i + 1], rest[i + 2]]);
    Ok(Call::Step(measurement(
        time_us,
        channels,
        three(8),
        three(11),
    )))
}
