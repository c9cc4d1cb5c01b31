//! Tables as CSV: one header, rows as long as it, quotes where a field needs them.

/// A table under construction.
pub struct CsvText {
    writer: csv::Writer<Vec<u8>>,
}

impl CsvText {
    /// A table without rows.
    pub fn new(header: &[&str]) -> Self {
        let mut writer = csv::Writer::from_writer(Vec::new());
        // Writing to a vector fails only for rows of another length.
        writer.write_record(header).expect("the first row");
        Self { writer }
    }

    /// More rows of a table that has its header already.
    pub fn continued() -> Self {
        let writer = csv::Writer::from_writer(Vec::new());
        Self { writer }
    }

    /// Adds rows.
    ///
    /// # Panics
    /// A row is not as long as the header.
    pub fn add(&mut self, rows: impl Iterator<Item = Vec<String>>) {
        for row in rows {
            self.writer
                .write_record(&row)
                .expect("as long as the header");
        }
    }

    /// The text.
    pub fn finish(self) -> Vec<u8> {
        self.writer.into_inner().expect("a vector takes everything")
    }
}

/// The text of a table.
///
/// # Panics
/// A row is not as long as the header.
pub fn csv(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Vec<u8> {
    let mut text = CsvText::new(header);
    text.add(rows);
    text.finish()
}

/// The shortest text that reads back as the same number; empty for none.
pub fn number(value: f64) -> String {
    if value.is_finite() {
        value.to_string()
    } else {
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use super::{csv, number};

    #[test]
    fn commas_and_quotes_in_a_field_stay_in_it() {
        let rows = [vec!["a, \"b\"".to_owned(), number(0.1)]];
        let text = csv(&["name", "value"], rows.into_iter());
        assert_eq!(text, b"name,value\n\"a, \"\"b\"\"\",0.1\n");
        let mut reader = csv::Reader::from_reader(text.as_slice());
        let record = reader.records().next().unwrap().unwrap();
        assert_eq!(&record[0], "a, \"b\"");
    }

    #[test]
    fn what_is_no_number_is_empty() {
        assert_eq!(
            (number(f64::NAN).as_str(), number(1e-9).as_str()),
            ("", "0.000000001")
        );
    }
}
