//! A CSV file with a header, its columns found by their names, in any case of letters.
//!
//! Quotes are RFC 4180's, and lines are read as those of flight files are. Before the header lines that begin
//! with `#` are comments; after it only those of a single field, for a flight's name may begin with one. Blanks
//! around numbers and columns' names are nothing; those around other texts are theirs.

use std::path::{Path, PathBuf};

use bnkf_model_export::flights::csv::records::{Record, Records, RecordsError, Separator};
use bnkf_model_export::flights::data_hash;
use bnkf_model_export::regular_file::{self, ReadFileCause};

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
    /// There is no header.
    #[error("the file is empty")]
    Empty,
    /// The lines are not records.
    #[error(transparent)]
    Records(#[from] RecordsError),
    /// A row of more or fewer fields than the header.
    #[error("{found} fields, where the header has {expected}")]
    Length {
        /// Its fields.
        found: usize,
        /// Those of the header.
        expected: usize,
    },
    /// The header lacks a column.
    #[error("there is no column {name}; the header has {found}")]
    NoColumn {
        /// Its name in backticks, or several.
        name: String,
        /// What the header has.
        found: String,
    },
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
    header: Record,
    names: Vec<String>,
    records: Records<Vec<u8>>,
}

/// One row.
pub struct Row {
    /// Its line, counted from 1.
    pub line: u64,
    record: Record,
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
        let bytes = regular_file::read(path, FILE_BYTES_MAX)
            .map_err(|error| failed(None, error.cause.into()))?;
        let sha256 = data_hash::of_bytes(&bytes);
        let mut records = Records::new(bytes, Separator::Comma);
        let header = first(&mut records);
        let header = header.map_err(|(line, cause)| failed(Some(line), cause.into()))?;
        let header = header.ok_or_else(|| failed(None, TableCause::Empty))?;
        records.comments = false;
        let names: Vec<String> = header.fields().map(str::to_owned).collect();
        for (index, name) in names.iter().enumerate() {
            if names[..index].iter().any(|other| is_same(other, name)) {
                return Err(failed(Some(header.line), TableCause::Twice(name.clone())));
            }
        }
        Ok(Self {
            path: path.to_owned(),
            sha256,
            header,
            names,
            records,
        })
    }

    /// Names of all columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Place of a column, if there is one of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|other| is_same(other, name))
    }

    /// Place of a column.
    ///
    /// # Errors
    /// There is none.
    pub fn column(&self, name: &str) -> Result<usize, TableError> {
        self.find(name)
            .ok_or_else(|| self.lacks(&format!("`{name}`")))
    }

    /// The error of a header without a column: its name in backticks, or several.
    pub fn lacks(&self, name: &str) -> TableError {
        let (name, found) = (name.to_owned(), self.found());
        self.header_fault(TableCause::NoColumn { name, found })
    }

    /// What the header has, and between what.
    fn found(&self) -> String {
        if self.header.width() > 1 {
            return self.header.list(Separator::Comma);
        }
        // Columns between anything else than commas look like a single one.
        let mut others = Separator::ALL.into_iter().filter_map(|separator| {
            let header = first(&mut Records::new(self.records.bytes(), separator));
            let header = header.ok().flatten().filter(|header| header.width() > 1)?;
            Some(format!("{}, not commas", header.list(separator)))
        });
        others
            .next()
            .unwrap_or_else(|| self.header.list(Separator::Comma))
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
                self.header_fault(TableCause::Half { there, lacks })
            })?;
        }
        Ok(Some(places))
    }

    /// The next row; `None` at the end.
    ///
    /// # Errors
    /// The line has more or fewer fields than the header, is not UTF-8, or opens a quote and closes none.
    pub fn next_row(&mut self) -> Result<Option<Row>, TableError> {
        let expected = self.header.width();
        loop {
            let record = self.records.next_record();
            let record = record.map_err(|(line, cause)| self.fault(Some(line), cause.into()))?;
            let Some(record) = record else {
                return Ok(None);
            };
            let (line, found) = (record.line, record.width());
            if found == expected {
                return Ok(Some(Row { line, record }));
            }
            if found > 1 || !record.field(0).starts_with('#') {
                return Err(self.fault(Some(line), TableCause::Length { found, expected }));
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

    /// An error in its header.
    pub fn header_fault(&self, cause: TableCause) -> TableError {
        self.fault(Some(self.header.line), cause)
    }
}

/// Whether two names are of one column.
pub fn is_same(name: &str, other: &str) -> bool {
    name.eq_ignore_ascii_case(other)
}

/// The first record that is no comment.
fn first<B: AsRef<[u8]>>(records: &mut Records<B>) -> Result<Option<Record>, (u64, RecordsError)> {
    loop {
        match records.next_record()? {
            Some(record) if record.is_comment() => {}
            other => return Ok(other),
        }
    }
}

impl Row {
    /// The text of a field, as it is: a name may begin or end with blanks.
    pub fn text(&self, column: usize) -> &str {
        self.record.text(column)
    }

    /// The text of a field without blanks around it.
    pub fn word(&self, column: usize) -> &str {
        self.record.field(column)
    }

    /// A finite number.
    ///
    /// # Errors
    /// Something else.
    pub fn number(&self, column: usize, name: &'static str) -> Result<f64, TableCause> {
        let number = self.word(column).parse::<f64>().ok();
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
        if self.word(column).is_empty() {
            return Ok(None);
        }
        self.number(column, name).map(Some)
    }

    /// A number without sign or fraction.
    ///
    /// # Errors
    /// Something else.
    pub fn count(&self, column: usize, name: &'static str) -> Result<u64, TableCause> {
        let number = self.word(column).parse().ok();
        number.ok_or_else(|| self.wrong(column, name, "a whole number from 0"))
    }

    /// What is wrong with a field.
    pub fn wrong(&self, column: usize, name: &'static str, expected: &'static str) -> TableCause {
        TableCause::Field {
            column: name,
            text: self.word(column).chars().take(40).collect(),
            expected,
        }
    }
}
