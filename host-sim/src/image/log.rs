//! Reads the image's defmt log: the format strings stand in the image's ELF file, the stream holds
//! their numbers and arguments.
//!
//! Covers what the image uses, defmt's wire format 4 with raw encoding, no time stamps, and the
//! argument types of `Argument`; anything else is an error and not a guess. The format is
//! described in the defmt book.

use std::collections::HashMap;
use std::fmt;

use object::{Object, ObjectSection, ObjectSymbol};

const SECTION: &str = ".defmt";
const WIRE_FORMAT: &str = "_defmt_version_ = 4";
const ENCODING: &str = "_defmt_encoding_ = raw";
const LEVEL_PREFIX: &str = "defmt_";

/// One message of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// `info`, `warn`, `error`, ...
    pub level: String,
    /// The message.
    pub text: String,
}

impl fmt::Display for LogLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<5} {}", self.level.to_uppercase(), self.text)
    }
}

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ImageLogError {
    /// The image is no ELF file.
    #[error("the image is no ELF file: {0}")]
    Elf(#[from] object::Error),
    /// The image does not log in the one format that is known.
    #[error("the image does not log in defmt's raw wire format 4")]
    WireFormat,
    /// A format string uses what is not covered.
    #[error("the format string `{0}` is not understood")]
    Format(String),
    /// The stream names a message that the image does not have, or stops within one.
    #[error("the log is garbled at byte {at}")]
    Garbled {
        /// Offset in the stream.
        at: usize,
    },
}

/// The messages an image can log.
#[derive(Debug)]
pub struct LogTable {
    messages: HashMap<u16, Message>,
}

#[derive(Debug)]
struct Message {
    level: String,
    parts: Vec<Part>,
}

#[derive(Debug, PartialEq)]
enum Part {
    Text(String),
    Argument(Argument, Hint),
}

/// Type of an argument on the wire, little-endian.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Argument {
    Bool,
    /// Unsigned, this many bytes.
    Unsigned(usize),
    F32,
    /// Length as u32, then UTF-8.
    Text,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Hint {
    Plain,
    /// `:x`, `:#x`, `:08x`: prefix wanted, digits at least.
    Hex {
        prefix: bool,
        digits: usize,
    },
}

#[derive(serde::Deserialize)]
struct Symbol {
    tag: String,
    data: String,
}

impl LogTable {
    /// Reads the messages out of the image's ELF file.
    ///
    /// # Errors
    /// Not an ELF file, or not the format this module reads.
    pub fn of_image(elf: &[u8]) -> Result<Self, ImageLogError> {
        let file = object::File::parse(elf)?;
        let section = file
            .section_by_name(SECTION)
            .ok_or(ImageLogError::WireFormat)?
            .index();
        let mut messages = HashMap::new();
        let (mut wire_format, mut encoding) = (false, false);
        for symbol in file.symbols() {
            if symbol.section_index() != Some(section) {
                continue;
            }
            let name = symbol.name()?;
            wire_format |= name == WIRE_FORMAT;
            encoding |= name == ENCODING;
            // Markers and the two names above are no JSON.
            let Ok(Symbol { tag, data }) = serde_json::from_str(name) else {
                continue;
            };
            let level = tag
                .strip_prefix(LEVEL_PREFIX)
                .filter(|level| *level != "timestamp")
                .ok_or(ImageLogError::WireFormat)?;
            let number = u16::try_from(symbol.address()).map_err(|_| ImageLogError::WireFormat)?;
            let message = Message {
                level: level.to_owned(),
                parts: parts(&data).ok_or_else(|| ImageLogError::Format(data.clone()))?,
            };
            messages.insert(number, message);
        }
        if wire_format && encoding {
            Ok(Self { messages })
        } else {
            Err(ImageLogError::WireFormat)
        }
    }

    /// Decodes a stream of messages.
    ///
    /// # Errors
    /// The stream does not belong to this image.
    pub fn decode(&self, stream: &[u8]) -> Result<Vec<LogLine>, ImageLogError> {
        let mut lines = Vec::new();
        let mut rest = stream;
        while !rest.is_empty() {
            let at = stream.len() - rest.len();
            let line = self.line(&mut rest).ok_or(ImageLogError::Garbled { at })?;
            lines.push(line);
        }
        Ok(lines)
    }

    fn line(&self, stream: &mut &[u8]) -> Option<LogLine> {
        let number = u16::from_le_bytes(*stream.split_off(..2)?.first_chunk()?);
        let message = self.messages.get(&number)?;
        let mut text = String::new();
        for part in &message.parts {
            match part {
                Part::Text(literal) => text.push_str(literal),
                Part::Argument(argument, hint) => text.push_str(&argument.read(stream, *hint)?),
            }
        }
        let level = message.level.clone();
        Some(LogLine { level, text })
    }
}

impl Argument {
    fn read(self, stream: &mut &[u8], hint: Hint) -> Option<String> {
        Some(match self {
            Self::Bool => (unsigned(stream, 1)? != 0).to_string(),
            Self::Unsigned(bytes) => {
                let value = unsigned(stream, bytes)?;
                match hint {
                    Hint::Plain => value.to_string(),
                    Hint::Hex { prefix, digits } if prefix => format!("{value:#0digits$x}"),
                    Hint::Hex { digits, .. } => format!("{value:0digits$x}"),
                }
            }
            Self::F32 => f32::from_bits(u32::try_from(unsigned(stream, 4)?).ok()?).to_string(),
            Self::Text => {
                let length = usize::try_from(unsigned(stream, 4)?).ok()?;
                String::from_utf8_lossy(stream.split_off(..length)?).into_owned()
            }
        })
    }
}

fn unsigned(stream: &mut &[u8], bytes: usize) -> Option<u64> {
    let bytes = stream.split_off(..bytes)?;
    Some(
        bytes
            .iter()
            .rev()
            .fold(0, |value, &byte| value << 8 | u64::from(byte)),
    )
}

/// Splits a format string; `None` for what is not covered.
fn parts(format: &str) -> Option<Vec<Part>> {
    let mut parts = Vec::new();
    let mut text = String::new();
    let mut rest = format;
    while let Some(next) = rest.chars().next() {
        if let Some(after) = rest.strip_prefix("{{").or_else(|| rest.strip_prefix("}}")) {
            text.push(next);
            rest = after;
        } else if let Some(after) = rest.strip_prefix('{') {
            let (inside, after) = after.split_once('}')?;
            if !text.is_empty() {
                parts.push(Part::Text(std::mem::take(&mut text)));
            }
            parts.push(argument(inside)?);
            rest = after;
        } else if next == '}' {
            return None;
        } else {
            text.push(next);
            rest = &rest[next.len_utf8()..];
        }
    }
    if !text.is_empty() {
        parts.push(Part::Text(text));
    }
    Some(parts)
}

/// `=type` or `=type:hint`.
fn argument(inside: &str) -> Option<Part> {
    let inside = inside.strip_prefix('=')?;
    let (kind, hint) = inside
        .split_once(':')
        .map_or((inside, None), |(k, h)| (k, Some(h)));
    let argument = match kind {
        "bool" => Argument::Bool,
        "u8" => Argument::Unsigned(1),
        "u16" => Argument::Unsigned(2),
        // A word on this target.
        "u32" | "usize" => Argument::Unsigned(4),
        "u64" => Argument::Unsigned(8),
        "f32" => Argument::F32,
        "str" => Argument::Text,
        _ => return None,
    };
    let hint = match hint {
        None => Hint::Plain,
        Some(hint) => {
            let digits = hint.strip_suffix('x')?;
            let (prefix, digits) = digits
                .strip_prefix('#')
                .map_or((false, digits), |d| (true, d));
            Hint::Hex {
                prefix,
                digits: if digits.is_empty() {
                    0
                } else {
                    digits.parse().ok()?
                },
            }
        }
    };
    Some(Part::Argument(argument, hint))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(messages: &[(u16, &str)]) -> LogTable {
        let message = |format: &str| Message {
            level: "info".to_owned(),
            parts: parts(format).unwrap(),
        };
        LogTable {
            messages: messages.iter().map(|(n, f)| (*n, message(f))).collect(),
        }
    }

    #[test]
    fn every_argument_type_is_read() {
        let table = table(&[
            (1, "{{a}} {=u8} {=u16} {=u32:08x} {=u32:#x} {=u64}"),
            (2, "{=bool}, {=f32}, `{=str}`"),
        ]);
        let mut stream = vec![1, 0, 7, 1, 2, 0xef, 0xbe, 0, 0, 0xff, 0, 0, 0];
        stream.extend(5u64.to_le_bytes());
        stream.extend([2, 0, 1]);
        stream.extend((-1.5f32).to_le_bytes());
        stream.extend([3, 0, 0, 0]);
        stream.extend("m\u{b2}".bytes());
        let lines = table.decode(&stream).unwrap();
        assert_eq!(lines[0].to_string(), "INFO  {a} 7 513 0000beef 0xff 5");
        assert_eq!(lines[1].text, "true, -1.5, `m\u{b2}`");
        assert_eq!(lines.len(), 2);
    }

    #[test]
    fn garbled_streams_are_errors() {
        let table = table(&[(1, "{=u32}"), (2, "{=str}")]);
        for (stream, at) in [
            (vec![9, 0], 0),
            (vec![1], 0),
            (vec![1, 0, 1, 2, 3, 4, 1, 0, 1], 6),
            (vec![2, 0, 255, 255, 255, 255, b'x'], 0),
        ] {
            match table.decode(&stream) {
                Err(ImageLogError::Garbled { at: found }) => assert_eq!(found, at),
                other => panic!("{stream:?} gave {other:?}"),
            }
        }
    }

    #[test]
    fn what_is_not_covered_is_refused() {
        for format in ["{}", "{=?}", "{=i32}", "{=u32:b}", "{=u8", "a } b"] {
            assert_eq!(parts(format), None, "{format}");
        }
        assert!(matches!(
            LogTable::of_image(b"no ELF file"),
            Err(ImageLogError::Elf(_))
        ));
    }
}
