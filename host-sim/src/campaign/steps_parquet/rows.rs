//! The rows of a group, and their columns.

use std::io::Write;

use bnkf_model_export::radar::reading::Reading;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::errors::ParquetError;

use super::FlightTracks;
use crate::campaign::step_record::{EstimateRecord, MethodSteps, StepRecord};
use crate::exchange::readings::{Numbers, numbers};
use crate::parquet_columns::{Group, column};

/// All of a group.
pub struct Rows<'a>(pub &'a [FlightTracks<'a>]);

/// One row and what it belongs to.
pub struct Row<'a> {
    /// The flight.
    pub of: &'a FlightTracks<'a>,
    /// The method's steps.
    pub track: &'a MethodSteps,
    /// Number of the step among them.
    pub index: usize,
    /// The step.
    pub step: &'a StepRecord,
}

impl Rows<'_> {
    /// A value of every row.
    pub fn map<T>(&self, value: impl Fn(Row<'_>) -> T) -> Vec<T> {
        let mut values = Vec::new();
        for of in self.0 {
            for track in &of.tracks {
                for (index, step) in track.steps.iter().enumerate() {
                    values.push(value(Row {
                        of,
                        track,
                        index,
                        step,
                    }));
                }
            }
        }
        values
    }
}

impl Row<'_> {
    /// The reading of the step's sample; the first sample has no step.
    pub fn reading(&self) -> Option<&Reading> {
        self.of.readings[self.index + 1].as_ref()
    }

    /// Truth and reading.
    pub fn numbers(&self) -> Numbers {
        let sample = &self.of.flight.samples[self.index + 1];
        numbers(sample.position_m, sample.velocity_mps, self.reading())
    }

    /// What the method said.
    pub fn estimate(&self) -> &EstimateRecord {
        &self.track.estimates[self.index]
    }
}

/// A text as a value.
pub fn string(text: &str) -> ByteArray {
    ByteArray::from(text.as_bytes().to_vec())
}

/// Writes a column of texts.
pub fn text<W: Write + Send>(
    group: &mut Group<'_, W>,
    rows: &Rows<'_>,
    value: impl Fn(Row<'_>) -> String,
) -> Result<(), ParquetError> {
    let bytes = |row: Row<'_>| ByteArray::from(value(row).into_bytes());
    column::<ByteArrayType, W>(group, rows.map(bytes))
}

/// Writes a column of whole numbers.
pub fn integers<W: Write + Send>(
    group: &mut Group<'_, W>,
    rows: &Rows<'_>,
    value: impl Fn(Row<'_>) -> i32,
) -> Result<(), ParquetError> {
    column::<Int32Type, W>(group, rows.map(value))
}

/// Writes a column of numbers.
pub fn doubles<W: Write + Send>(
    group: &mut Group<'_, W>,
    rows: &Rows<'_>,
    value: impl Fn(Row<'_>) -> f64,
) -> Result<(), ParquetError> {
    column::<DoubleType, W>(group, rows.map(value))
}

/// Writes a column of truths.
pub fn booleans<W: Write + Send>(
    group: &mut Group<'_, W>,
    rows: &Rows<'_>,
    value: impl Fn(Row<'_>) -> bool,
) -> Result<(), ParquetError> {
    column::<BoolType, W>(group, rows.map(value))
}
