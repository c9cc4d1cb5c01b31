//! ArduPilot's log: positions of its EKF (`XKF1`, core 0; before that `NKF1`), or where there is none of `POS`.
//!
//! Read here and not by a crate: ardupilot-binlog 0.2 panics on definitions of no length. Format: ArduPilot's
//! `AP_Logger`, `LogStructure.h`. Nothing here panics, whatever the bytes are.

use std::collections::HashMap;

use super::geodetic::Geodetic;
use super::ulog::Rows;

/// First bytes of every such file: a definition.
pub const MAGIC: &[u8] = &[HEAD[0], HEAD[1], DEFINITION];
/// What every message begins with.
const HEAD: [u8; 2] = [0xA3, 0x95];
/// Type of the messages that define the others.
const DEFINITION: u8 = 0x80;
/// Bytes of a definition after its header: type, length, name, format, labels.
const DEFINITION_BYTES: usize = 86;
/// Bytes before a message's fields.
const HEADER_BYTES: usize = 3;

/// Why a log holds no flight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DataflashError {
    /// No message with a position.
    #[error("an ArduPilot log without a position: none of the messages XKF1, NKF1 and POS")]
    NoPosition,
}

/// The positions in `bytes`. Where a message is damaged the next one that is whole goes on.
///
/// # Errors
/// See [`DataflashError`].
pub fn parse(bytes: &[u8]) -> Result<Rows, DataflashError> {
    let mut kinds: HashMap<u8, Kind<'_>> = HashMap::new();
    let (mut ekf3, mut ekf2, mut places) = (Vec::new(), Vec::new(), Vec::new());
    let mut rest = bytes;
    let mut skipped = 0_usize;
    while let [_, after @ ..] = rest {
        let message = match rest {
            [first, second, kind, body @ ..] if [*first, *second] == HEAD => {
                message(*kind, body, &kinds)
            }
            _ => None,
        };
        let Some((kind, body, left)) = message else {
            skipped += 1;
            rest = after;
            continue;
        };
        rest = left;
        match kind {
            None => {
                if let Some((number, kind)) = Kind::defined(body) {
                    kinds.insert(number, kind);
                }
            }
            Some(kind) => match kind.name {
                b"XKF1" => ekf3.extend(kind.local(body)),
                b"NKF1" => ekf2.extend(kind.local(body)),
                b"POS" => places.extend(kind.global(body)),
                _ => {}
            },
        }
    }
    let mut notes = Vec::new();
    if skipped > 0 {
        notes.push(format!(
            "{skipped} bytes of the log passed over that are no whole message"
        ));
    }
    let mut rows = if !ekf3.is_empty() {
        ekf3
    } else if !ekf2.is_empty() {
        ekf2
    } else {
        let Some((_, origin)) = places.first().copied() else {
            return Err(DataflashError::NoPosition);
        };
        notes.push("positions of POS: the log has none of the EKF".to_owned());
        let row = |(time_s, place): &(f64, Geodetic)| {
            let [east, north, up] = place.east_north_up(&origin);
            [*time_s, east, north, up]
        };
        places.iter().map(row).collect()
    };
    let start_s = rows.first().map_or(0.0, |row: &[f64; 4]| row[0]);
    for row in &mut rows {
        row[0] -= start_s;
    }
    Ok(Rows { rows, notes })
}

/// Kind (`None` for a definition), fields, and what comes after; `None` if the message is not whole.
type Message<'k, 'a> = (Option<&'k Kind<'a>>, &'a [u8], &'a [u8]);

fn message<'k, 'a>(
    number: u8,
    body: &'a [u8],
    kinds: &'k HashMap<u8, Kind<'a>>,
) -> Option<Message<'k, 'a>> {
    if number == DEFINITION {
        let (body, left) = body.split_at_checked(DEFINITION_BYTES)?;
        return Some((None, body, left));
    }
    let kind = kinds.get(&number)?;
    let (body, left) = body.split_at_checked(kind.bytes)?;
    Some((Some(kind), body, left))
}

/// How a message of one type is laid out.
struct Kind<'a> {
    name: &'a [u8],
    /// Bytes of its fields.
    bytes: usize,
    /// One letter a field.
    types: &'a [u8],
    labels: Vec<&'a [u8]>,
}

impl<'a> Kind<'a> {
    /// The kind that a definition is of, and its number.
    fn defined(body: &'a [u8]) -> Option<(u8, Self)> {
        let [number, length, rest @ ..] = body else {
            return None;
        };
        let (name, rest) = rest.split_at_checked(4)?;
        let (types, labels) = rest.split_at_checked(16)?;
        let kind = Self {
            name: text(name),
            bytes: usize::from(*length).checked_sub(HEADER_BYTES)?,
            types: text(types),
            labels: text(labels).split(|byte| *byte == b',').collect(),
        };
        Some((*number, kind))
    }

    /// A field as a number.
    fn number(&self, body: &[u8], label: &str) -> Option<f64> {
        let index = self
            .labels
            .iter()
            .position(|own| *own == label.as_bytes())?;
        let before = self.types.get(..index)?.iter();
        let at = before
            .map(|kind| size_of_type(*kind))
            .sum::<Option<usize>>()?;
        number(*self.types.get(index)?, body.get(at..)?)
    }

    /// Seconds since the boot.
    fn time_s(&self, body: &[u8]) -> Option<f64> {
        self.number(body, "TimeUS").map(|time_us| 1e-6 * time_us)
    }

    /// Seconds, and east, north, up of the first core.
    fn local(&self, body: &[u8]) -> Option<[f64; 4]> {
        let is_first_core = self.number(body, "C").is_none_or(|core| core == 0.0);
        let [north, east, down] = ["PN", "PE", "PD"].map(|label| self.number(body, label));
        is_first_core.then_some([self.time_s(body)?, east?, north?, -down?])
    }

    /// Seconds and place; latitude and longitude are logged in ten millionths of a degree.
    fn global(&self, body: &[u8]) -> Option<(f64, Geodetic)> {
        let place = Geodetic {
            latitude_deg: 1e-7 * self.number(body, "Lat")?,
            longitude_deg: 1e-7 * self.number(body, "Lng")?,
            height_m: self.number(body, "Alt")?,
        };
        place.is_a_place().then_some((self.time_s(body)?, place))
    }
}

/// Up to the first zero.
fn text(bytes: &[u8]) -> &[u8] {
    bytes.split(|byte| *byte == 0).next().unwrap_or_default()
}

/// Bytes of a field.
fn size_of_type(kind: u8) -> Option<usize> {
    Some(match kind {
        b'b' | b'B' | b'M' => 1,
        b'h' | b'H' | b'c' | b'C' | b'g' => 2,
        b'i' | b'I' | b'f' | b'n' | b'e' | b'E' | b'L' => 4,
        b'd' | b'q' | b'Q' => 8,
        b'N' => 16,
        b'Z' | b'a' => 64,
        _ => return None,
    })
}

/// A number of one of the types that positions have.
fn number(kind: u8, bytes: &[u8]) -> Option<f64> {
    Some(match kind {
        b'B' => f64::from(*bytes.first()?),
        b'b' => f64::from(bytes.first()?.cast_signed()),
        b'f' => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
        b'd' => f64::from_le_bytes(*bytes.first_chunk()?),
        b'i' | b'L' => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
        // Microseconds since the boot: exact for 285 years.
        b'Q' => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
        // Hundredths, as logs of old had heights.
        b'e' => 0.01 * f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_no_position_is_said() {
        assert_eq!(parse(MAGIC), Err(DataflashError::NoPosition));
        assert_eq!(parse(&[0xA3; 500]), Err(DataflashError::NoPosition));
    }

    #[test]
    fn numbers_have_the_size_of_their_type() {
        let bytes = [0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0];
        assert_eq!(number(b'b', &bytes), Some(-1.0));
        assert_eq!(number(b'B', &bytes), Some(255.0));
        assert_eq!(number(b'L', &bytes), Some(-1.0));
        assert_eq!(number(b'e', &bytes), Some(-0.01));
        assert_eq!(number(b'Q', &bytes), Some(4_294_967_295.0));
        assert!(number(b'Q', &bytes[..7]).is_none() && number(b'Z', &bytes).is_none());
    }
}
