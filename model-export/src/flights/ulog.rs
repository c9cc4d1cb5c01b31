//! PX4's log: positions of the topic `vehicle_local_position`, first instance, that it marks as valid.
//!
//! Read here and not by a crate: px4-ulog 0.6 panics on messages of no length. Format: PX4's user guide, "ULog File
//! Format". Nothing here panics, whatever the bytes are.

use std::collections::HashMap;

/// First bytes of every such file.
pub const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Bytes before the first message: magic, version, time.
const HEADER_BYTES: usize = 16;
/// Where positions are.
const TOPIC: &str = "vehicle_local_position";
/// Bytes of a message of data before its fields: the number of its subscription.
const NUMBER_BYTES: usize = 2;

/// Why a log holds no flight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UlogError {
    /// The topic is there, and its fields are not what PX4 logs.
    #[error("a ULog whose topic `{TOPIC}` has no `{0}` of the type that PX4 logs")]
    Fields(&'static str),
    /// The topic is not there, or holds no valid position.
    #[error(
        "a ULog without a valid position in topic `{TOPIC}`; log it, or convert another topic to CSV"
    )]
    NoPosition,
}

/// Times and places of a log, and what to say of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Seconds since the first; east, north, up, metres.
    pub rows: Vec<[f64; 4]>,
    /// What was left out or assumed.
    pub notes: Vec<String>,
}

/// The positions in `bytes`. A log that breaks off gives what came before.
///
/// # Errors
/// See [`UlogError`].
pub fn parse(bytes: &[u8]) -> Result<Rows, UlogError> {
    let mut layouts: HashMap<&[u8], Result<Layout, UlogError>> = HashMap::new();
    // Of the topic's first instance: the number under which its data come.
    let mut subscribed: Option<(u16, &Result<Layout, UlogError>)> = None;
    let (mut rows, mut invalid, mut start_us) = (Vec::new(), 0_usize, None);
    let mut messages = Messages {
        rest: bytes.get(HEADER_BYTES..).unwrap_or_default(),
    };
    // Formats stand before what they describe.
    for (kind, body) in messages.clone() {
        if kind == b'F'
            && let Some((name, fields)) = split(body, b':')
            && name == TOPIC.as_bytes()
        {
            layouts.insert(name, Layout::of(fields));
        }
    }
    for (kind, body) in messages.by_ref() {
        match (kind, body) {
            (b'A', [0, low, high, name @ ..]) => {
                if let Some(layout) = layouts.get(name) {
                    subscribed = Some((u16::from_le_bytes([*low, *high]), layout));
                }
            }
            (b'D', [low, high, ..]) => {
                let number = u16::from_le_bytes([*low, *high]);
                let Some((_, layout)) = subscribed.filter(|(own, _)| *own == number) else {
                    continue;
                };
                let layout = layout.as_ref().map_err(Clone::clone)?;
                let Some(position) = layout.position(body) else {
                    continue;
                };
                if !position.valid {
                    invalid += 1;
                    continue;
                }
                let start_us = *start_us.get_or_insert(position.time_us);
                let since_us = position.time_us.wrapping_sub(start_us).cast_signed();
                let [north, east, down] = position.north_east_down_m;
                rows.push([1e-6 * since_us as f64, east, north, -down]);
            }
            _ => {}
        }
    }
    if rows.is_empty() {
        return Err(UlogError::NoPosition);
    }
    let mut notes = Vec::new();
    if !messages.rest.is_empty() {
        notes.push("the log breaks off within a message; what came before was read".to_owned());
    }
    if invalid > 0 {
        notes.push(format!(
            "{invalid} positions left out that the log marks as invalid"
        ));
    }
    Ok(Rows { rows, notes })
}

/// Messages one after the other: kind and body. What is left is no whole message.
#[derive(Clone)]
struct Messages<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Messages<'a> {
    type Item = (u8, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let [low, high, kind, rest @ ..] = self.rest else {
            return None;
        };
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        let (body, rest) = rest.split_at_checked(length)?;
        self.rest = rest;
        Some((*kind, body))
    }
}

fn split(text: &[u8], at: u8) -> Option<(&[u8], &[u8])> {
    let place = text.iter().position(|byte| *byte == at)?;
    Some((text.get(..place)?, text.get(place + 1..)?))
}

/// Where the fields of a position stand in a message of data.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Layout {
    time: usize,
    places: [usize; 3],
    /// Flags that say what is not known; a log that has none has valid positions.
    marks: Vec<usize>,
}

/// One message.
struct Position {
    time_us: u64,
    north_east_down_m: [f64; 3],
    valid: bool,
}

impl Layout {
    /// The layout that `type name;type name;...` gives. Fields after the last one of interest may have any type.
    fn of(fields: &[u8]) -> Result<Self, UlogError> {
        let mut found: HashMap<&str, (usize, &str)> = HashMap::new();
        let mut at = NUMBER_BYTES;
        for field in fields.split(|byte| *byte == b';') {
            let field = std::str::from_utf8(field)
                .ok()
                .and_then(|field| field.split_once(' '));
            let Some((kind, name)) = field else { break };
            let Some(size) = size_of_type(kind) else {
                break;
            };
            found.insert(name, (at, kind));
            at += size;
        }
        let place = |name: &'static str, kind: &str| {
            let field = found.get(name).filter(|field| field.1 == kind);
            field.map(|field| field.0).ok_or(UlogError::Fields(name))
        };
        let marks = ["xy_valid", "z_valid"].into_iter();
        Ok(Self {
            time: place("timestamp", "uint64_t")?,
            places: [
                place("x", "float")?,
                place("y", "float")?,
                place("z", "float")?,
            ],
            marks: marks.filter_map(|name| place(name, "bool").ok()).collect(),
        })
    }

    /// What a message says; `None` if it is too short.
    fn position(&self, body: &[u8]) -> Option<Position> {
        let time_us = u64::from_le_bytes(*body.get(self.time..)?.first_chunk()?);
        let mut north_east_down_m = [0.0; 3];
        for (slot, at) in north_east_down_m.iter_mut().zip(self.places) {
            *slot = f64::from(f32::from_le_bytes(*body.get(at..)?.first_chunk()?));
        }
        let known = self
            .marks
            .iter()
            .all(|at| body.get(*at).is_some_and(|mark| *mark != 0));
        let valid = known && north_east_down_m.iter().all(|x| x.is_finite());
        Some(Position {
            time_us,
            north_east_down_m,
            valid,
        })
    }
}

/// Bytes of a basic type or of an array of one; nothing for a nested one.
fn size_of_type(kind: &str) -> Option<usize> {
    let (base, count) = match kind.split_once('[') {
        Some((base, count)) => (base, count.strip_suffix(']')?.parse::<u16>().ok()?),
        None => (kind, 1),
    };
    let size = match base {
        "int8_t" | "uint8_t" | "bool" | "char" => 1,
        "int16_t" | "uint16_t" => 2,
        "int32_t" | "uint32_t" | "float" => 4,
        "int64_t" | "uint64_t" | "double" => 8,
        _ => return None,
    };
    Some(size * usize::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_log_is_said() {
        assert_eq!(parse(MAGIC), Err(UlogError::NoPosition));
        let mut damaged = MAGIC.to_vec();
        damaged.extend([1, 0, 0, 0, 0, 0, 0, 0, 0]);
        damaged.extend([0xff; 400]);
        assert_eq!(parse(&damaged), Err(UlogError::NoPosition));
    }

    #[test]
    fn fields_are_where_their_types_put_them() {
        let layout = Layout::of(b"uint64_t timestamp;uint8_t[3] reset;float x;float y;float z;bool z_valid;nested odd;bool xy_valid;");
        let expected = Layout {
            time: 2,
            places: [13, 17, 21],
            marks: vec![25],
        };
        assert_eq!(layout, Ok(expected));
        assert_eq!(
            Layout::of(b"uint64_t timestamp;double x;float y;float z;"),
            Err(UlogError::Fields("x"))
        );
        assert_eq!(
            Layout::of(b"float x;float y;float z;"),
            Err(UlogError::Fields("timestamp"))
        );
        assert_eq!(size_of_type("float[12]"), Some(48));
        assert!(
            ["float[", "float[x]", "float[70000]", "message"]
                .iter()
                .all(|kind| size_of_type(kind).is_none())
        );
    }
}
