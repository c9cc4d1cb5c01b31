//! The lines of a table as records of text fields: flight files, and those of `host-sim`.

use csv::{ByteRecord, Reader, ReaderBuilder};
use std::io::Cursor;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Most lines that a quoted field may span: more means that a quote is missing, and everything
/// between it and the next one would be swallowed.
const RECORD_LINES_MAX: u64 = 64;

/// Most columns that a message lists, and most characters of each.
const LISTED_COLUMNS_MAX: usize = 12;
const LISTED_CHARACTERS_MAX: usize = 24;

/// What stands between two columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// `,`
    Comma,
    /// `;`, where the comma is the decimal sign.
    Semicolon,
    /// A tab.
    Tab,
    /// One or more blanks, as in trajectory files of the TUM form.
    Blank,
}

impl Separator {
    /// All, in the order in which they are tried.
    pub const ALL: [Self; 4] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Blank];

    /// Its name, several of them.
    pub fn name(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
            Self::Blank => "blanks",
        }
    }

    /// Whether it stands anywhere in `bytes`.
    pub fn occurs_in(self, bytes: &[u8]) -> bool {
        bytes.contains(&self.byte())
    }

    fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
            Self::Blank => b' ',
        }
    }
}

/// Why lines are not records.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordsError {
    /// Not UTF-8.
    #[error("not UTF-8 text")]
    NotUtf8,
    /// Two bytes a character, as some spreadsheets save it.
    #[error("UTF-16 text; save the file as UTF-8")]
    Utf16,
    /// A quote opens a field and nothing closes it.
    #[error("a quote is opened here and not closed within {RECORD_LINES_MAX} lines")]
    OpenQuote,
    /// Blanks before a quote, which therefore quotes nothing.
    #[error("blanks stand before a quote; RFC 4180 wants it to begin its field")]
    BlankBeforeQuote,
}

/// One line, or several where a quoted field has line breaks.
#[derive(Clone, Debug)]
pub struct Record {
    /// Its first line, counted from 1.
    pub line: u64,
    fields: Vec<String>,
    comment: bool,
}

impl Record {
    /// Field `index` without blanks around it; nothing where the line ends before it.
    pub fn field(&self, index: usize) -> &str {
        self.text(index).trim()
    }

    /// Field `index` with the blanks around it.
    pub fn text(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }

    /// The fields without blanks around them; of a comment without the `#`.
    pub fn fields(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|field| field.trim())
    }

    /// Number of fields.
    pub fn width(&self) -> usize {
        self.fields.len()
    }

    /// The first fields and what separates them, as a message can hold them.
    pub fn list(&self, separator: Separator) -> String {
        let shown = self.fields().take(LISTED_COLUMNS_MAX).map(|name| {
            let short: String = name.chars().take(LISTED_CHARACTERS_MAX).collect();
            format!("`{}`", short.escape_debug())
        });
        let mut names: Vec<String> = shown.collect();
        if self.width() > LISTED_COLUMNS_MAX {
            names.push(format!("{} more", self.width() - LISTED_COLUMNS_MAX));
        }
        let names = names.join(", ");
        if self.width() == 1 {
            names
        } else {
            format!("{names} between {}", separator.name())
        }
    }

    /// Whether a `#` begins it.
    pub fn is_comment(&self) -> bool {
        self.comment
    }
}

/// The records of a file, one after the other.
pub struct Records<B> {
    /// What separates their fields.
    pub separator: Separator,
    /// Whether a `#` begins a comment; else it is a character like any other.
    pub comments: bool,
    reader: Reader<Cursor<B>>,
    /// Where the text begins in the bytes.
    start: usize,
    record: ByteRecord,
}

impl<B: AsRef<[u8]>> Records<B> {
    /// The records of `bytes`.
    pub fn new(bytes: B, separator: Separator) -> Self {
        let marked = bytes.as_ref().starts_with(BYTE_ORDER_MARK);
        let start = if marked { BYTE_ORDER_MARK.len() } else { 0 };
        let mut text = Cursor::new(bytes);
        text.set_position(start as u64);
        let reader = ReaderBuilder::new()
            .delimiter(separator.byte())
            .has_headers(false)
            .flexible(true)
            .from_reader(text);
        Self {
            separator,
            comments: true,
            reader,
            start,
            record: ByteRecord::new(),
        }
    }

    /// All that is read.
    pub fn bytes(&self) -> &[u8] {
        self.reader.get_ref().get_ref().as_ref()
    }

    /// Where the next record begins.
    fn position(&self) -> usize {
        let read = usize::try_from(self.reader.position().byte());
        read.map_or(usize::MAX, |read| self.start.saturating_add(read))
    }

    /// The next record that is not blank; a spreadsheet saves an empty row as separators.
    ///
    /// # Errors
    /// The line, and why it is no record.
    pub fn next_record(&mut self) -> Result<Option<Record>, (u64, RecordsError)> {
        loop {
            let start = self.position();
            let rest = self.bytes().get(start..).unwrap_or_default();
            // The reader passes over blank lines, but says that the record begins with them.
            let breaks = rest.iter().take_while(|byte| b"\r\n".contains(byte));
            let blank = breaks.filter(|byte| **byte == b'\n').count() as u64;
            let line = self.reader.position().line() + blank;
            let at = |cause: RecordsError| (line, cause);
            let more = self.reader.read_byte_record(&mut self.record);
            // Bytes in memory are read without failing, and records may have any length.
            if !more.unwrap_or(false) {
                return Ok(None);
            }
            let end = self.position();
            let raw = self.bytes().get(start..end).unwrap_or_default();
            if self.reader.position().line() > line + RECORD_LINES_MAX {
                return Err(at(RecordsError::OpenQuote));
            }
            // RFC 4180 has quotes in pairs: one that stays open takes all up to the next one, or to the file's end.
            let inside = self.record.iter().any(|field| field.contains(&b'\n'));
            let quotes = raw.iter().filter(|byte| **byte == b'"').count();
            if inside && quotes % 2 == 1 {
                return Err(at(RecordsError::OpenQuote));
            }
            if start == self.start && (raw.starts_with(b"\xff\xfe") || raw.starts_with(b"\xfe\xff"))
            {
                return Err(at(RecordsError::Utf16));
            }
            let mut fields = Vec::with_capacity(self.record.len());
            for field in &self.record {
                fields.push(text(field).map_err(at)?);
            }
            if self.separator == Separator::Blank {
                fields.retain(|field| !field.trim().is_empty());
            }
            if fields.iter().all(|field| field.trim().is_empty()) {
                continue;
            }
            let comment = self.comments && fields[0].trim_start().starts_with('#');
            if comment {
                let title = fields[0].trim().trim_start_matches('#').to_owned();
                fields[0] = title;
                if fields[0].trim().is_empty() && self.separator == Separator::Blank {
                    fields.remove(0);
                }
            }
            return Ok(Some(Record {
                line,
                fields,
                comment,
            }));
        }
    }
}

fn text(field: &[u8]) -> Result<String, RecordsError> {
    let text = std::str::from_utf8(field).map_err(|_| RecordsError::NotUtf8)?;
    let trimmed = text.trim();
    if trimmed.starts_with('"') && text.starts_with([' ', '\t']) {
        // Whole and without quotes inside it means what it seems to; else columns would shift.
        return match trimmed[1..].strip_suffix('"') {
            Some(inner) if !inner.contains('"') => Ok(inner.trim().to_owned()),
            _ => Err(RecordsError::BlankBeforeQuote),
        };
    }
    Ok(text.to_owned())
}
