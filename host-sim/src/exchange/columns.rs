//! A CSV file with a header, its columns found by their names.

use std::path::{Path, PathBuf};

use bnkf_model_export::flights::data_hash;
use bnkf_model_export::regular_file::{self, ReadFileCause};
use csv::{ReaderBuilder, StringRecord, StringRecordsIntoIter};

/// Largest file, bytes.
pub const FILE_BYTES_MAX: u64 = 1 << 30;

/// Why a file is no such table, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {cause}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
pub struct TableError {
    /// The file.
    pub path: PathBuf,
    /// Its line, counted from 1, where the cause has one.
    pub line: Option<u64>,
    /// What is wrong.
    #[source]
    pub cause: TableCause,
}

/// What is wrong with a table.
#[derive(Debug, thiserror::Error)]
pub enum TableCause {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileCause),
    /// The lines are not records of as many fields as the header has.
    #[error("{0}")]
    Csv(String),
    /// The header lacks a column.
    #[error("there is no column `{0}`")]
    NoColumn(String),
    /// The header names a column twice.
    #[error("the column `{0}` is there twice")]
    Twice(String),
    /// Some columns of a group are there and others are not.
    #[error("there is a column `{there}`, but not `{lacks}`")]
    Half {
        /// One that is there.
        there: String,
        /// One that is not.
        lacks: String,
    },
    /// A field does not hold what its column should.
    #[error("`{column}` is {text:?}, not {expected}")]
    Field {
        /// The column.
        column: &'static str,
        /// The first characters of what stands there.
        text: String,
        /// What should.
        expected: &'static str,
    },
    /// The row does not fit to the rest of the file or to what it is about.
    #[error("{0}")]
    Row(String),
}

/// The rows of a table.
pub struct Table {
    path: PathBuf,
    /// SHA-256 of the file.
    pub sha256: String,
    header: Vec<String>,
    rows: StringRecordsIntoIter<std::io::Cursor<Vec<u8>>>,
}

/// One row.
pub struct Row {
    /// Its line, counted from 1.
    pub line: u64,
    record: StringRecord,
}

impl Table {
    /// Opens a table and reads its header.
    ///
    /// # Errors
    /// It cannot be read, or names a column twice.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        let failed = |line, cause| TableError {
            path: path.to_owned(),
            line,
            cause,
        };
        let mut bytes = regular_file::read(path, FILE_BYTES_MAX)
            .map_err(|error| failed(None, error.cause.into()))?;
        let sha256 = data_hash::of_bytes(&bytes);
        if bytes.starts_with(b"\xef\xbb\xbf") {
            bytes.drain(..3);
        }
        let mut reader = ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(std::io::Cursor::new(bytes));
        let header = reader
            .headers()
            .map_err(|error| failed(Some(1), TableCause::Csv(error.to_string())))?;
        let header: Vec<String> = header.iter().map(str::to_owned).collect();
        for (index, name) in header.iter().enumerate() {
            if header[..index].contains(name) {
                return Err(failed(Some(1), TableCause::Twice(name.clone())));
            }
        }
        Ok(Self {
            path: path.to_owned(),
            sha256,
            header,
            rows: reader.into_records(),
        })
    }

    /// Names of all columns.
    pub fn names(&self) -> &[String] {
        &self.header
    }

    /// Place of a column, if there is one of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|other| other == name)
    }

    /// Place of a column.
    ///
    /// # Errors
    /// There is none.
    pub fn column(&self, name: &str) -> Result<usize, TableError> {
        self.find(name)
            .ok_or_else(|| self.fault(Some(1), TableCause::NoColumn(name.to_owned())))
    }

    /// Places of columns that belong together; `None` where none of them is there.
    ///
    /// # Errors
    /// Only some are.
    pub fn group<const N: usize>(
        &self,
        names: [&str; N],
    ) -> Result<Option<[usize; N]>, TableError> {
        let Some(there) = names.iter().find(|name| self.find(name).is_some()) else {
            return Ok(None);
        };
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = self.find(name).ok_or_else(|| {
                let (there, lacks) = ((*there).to_owned(), name.to_owned());
                self.fault(Some(1), TableCause::Half { there, lacks })
            })?;
        }
        Ok(Some(places))
    }

    /// The next row; `None` at the end.
    ///
    /// # Errors
    /// The line has more or fewer fields than the header, or is not UTF-8.
    pub fn next_row(&mut self) -> Result<Option<Row>, TableError> {
        match self.rows.next() {
            None => Ok(None),
            Some(Ok(record)) => Ok(Some(Row {
                line: record.position().map_or(0, csv::Position::line),
                record,
            })),
            Some(Err(error)) => {
                let line = error.position().map(csv::Position::line);
                Err(self.fault(line, TableCause::Csv(said(&error))))
            }
        }
    }

    /// An error in this file.
    pub fn fault(&self, line: Option<u64>, cause: TableCause) -> TableError {
        TableError {
            path: self.path.clone(),
            line,
            cause,
        }
    }
}

/// Without the position, which [`TableError`] says.
fn said(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} fields, where the header has {expected_len}"),
        csv::ErrorKind::Utf8 { .. } => "not UTF-8 text".to_owned(),
        _ => error.to_string(),
    }
}

impl Row {
    /// The text of a field.
    pub fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }

    /// A finite number.
    ///
    /// # Errors
    /// Something else.
    pub fn number(&self, column: usize, name: &'static str) -> Result<f64, TableCause> {
        let number = self.text(column).parse::<f64>().ok();
        number
            .filter(|number| number.is_finite())
            .ok_or_else(|| self.wrong(column, name, "a finite number"))
    }

    /// A finite number, or nothing.
    ///
    /// # Errors
    /// Something else.
    pub fn number_or_none(
        &self,
        column: usize,
        name: &'static str,
    ) -> Result<Option<f64>, TableCause> {
        if self.text(column).is_empty() {
            return Ok(None);
        }
        self.number(column, name).map(Some)
    }

    /// A number without sign or fraction.
    ///
    /// # Errors
    /// Something else.
    pub fn count(&self, column: usize, name: &'static str) -> Result<u64, TableCause> {
        let number = self.text(column).parse().ok();
        number.ok_or_else(|| self.wrong(column, name, "a whole number from 0"))
    }

    /// What is wrong with a field.
    pub fn wrong(&self, column: usize, name: &'static str, expected: &'static str) -> TableCause {
        TableCause::Field {
            column: name,
            text: self.text(column).chars().take(40).collect(),
            expected,
        }
    }
}
