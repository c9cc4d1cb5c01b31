//! Columns of a Parquet file, one after the other.

use std::io::Write;

use parquet::basic::Compression;
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedRowGroupWriter;

/// Rows under construction.
pub type Group<'a, W> = SerializedRowGroupWriter<'a, W>;

/// How files are compressed.
pub fn snappy() -> WriterProperties {
    WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .build()
}

/// Writes the next column.
///
/// # Errors
/// The schema has no more columns, or another type there, or the file takes no more.
pub fn column<T: DataType, W: Write + Send>(
    group: &mut Group<'_, W>,
    values: Vec<T::T>,
) -> Result<(), ParquetError> {
    levelled::<T, W>(group, &values, None)
}

/// The same where a row may have nothing.
///
/// # Errors
/// As [`column()`].
pub fn optional<T: DataType, W: Write + Send>(
    group: &mut Group<'_, W>,
    values: Vec<Option<T::T>>,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values
        .iter()
        .map(|value| i16::from(value.is_some()))
        .collect();
    let present: Vec<_> = values.into_iter().flatten().collect();
    levelled::<T, W>(group, &present, Some(&levels))
}

fn levelled<T: DataType, W: Write + Send>(
    group: &mut Group<'_, W>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let mut writer = group
        .next_column()?
        .ok_or_else(|| ParquetError::General("more columns than the schema has".to_owned()))?;
    writer.typed::<T>().write_batch(values, levels, None)?;
    writer.close()
}
