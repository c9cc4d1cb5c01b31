//! PX4's log: positions of the topic `vehicle_local_position`, first instance, that it marks as valid.

use px4_ulog::stream_parser::model::{FlattenedFieldType, FlattenedFormat};
use px4_ulog::stream_parser::{DataMessage, LogParser};

/// First bytes of every such file.
pub const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Where positions are.
const TOPIC: &str = "vehicle_local_position";

/// Why a log holds no flight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UlogError {
    /// The definitions at its beginning cannot be read.
    #[error("a ULog whose beginning cannot be read: {0}")]
    Damaged(String),
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
    let (mut rows, mut invalid) = (Vec::new(), 0_usize);
    let mut start_us = None;
    let mut take = |message: &DataMessage<'_>| {
        let format = message.flattened_format;
        if format.message_name() != TOPIC || message.multi_id.value() != 0 {
            return;
        }
        let Some((time_us, [x, y, z], valid)) = position(format, message.data) else {
            return;
        };
        if !valid {
            invalid += 1;
            return;
        }
        let since_us = time_us
            .wrapping_sub(*start_us.get_or_insert(time_us))
            .cast_signed();
        rows.push([1e-6 * since_us as f64, y, x, -z]);
    };
    let mut parser = LogParser::default();
    parser.set_data_message_callback(&mut take);
    let parsed = parser.consume_bytes(bytes);
    let (in_data, leftover) = (parser.in_data(), parser.has_leftover());
    let mut notes = Vec::new();
    match parsed {
        Err(error) if !in_data => return Err(UlogError::Damaged(format!("{error}"))),
        Err(_) => notes.push(
            "the log breaks off with a damaged message; what came before was read".to_owned(),
        ),
        Ok(()) if leftover => {
            notes.push("the log breaks off within a message; what came before was read".to_owned())
        }
        Ok(()) => {}
    }
    if rows.is_empty() {
        return Err(UlogError::NoPosition);
    }
    if invalid > 0 {
        notes.push(format!(
            "{invalid} positions left out that the log marks as invalid"
        ));
    }
    Ok(Rows { rows, notes })
}

/// Time, north, east, down, and whether they are valid; `None` if a field is missing.
fn position(format: &FlattenedFormat, data: &[u8]) -> Option<(u64, [f64; 3], bool)> {
    let at = |name: &str, kind| format.get_field_offset(name, kind).ok().map(usize::from);
    let time = at("timestamp", FlattenedFieldType::UInt64)?;
    let time_us = u64::from_le_bytes(*data.get(time..)?.first_chunk()?);
    let mut place = [0.0; 3];
    for (slot, name) in place.iter_mut().zip(["x", "y", "z"]) {
        let at = at(name, FlattenedFieldType::Float)?;
        *slot = f64::from(f32::from_le_bytes(*data.get(at..)?.first_chunk()?));
    }
    // A log that does not mark its positions has valid ones.
    let marks = ["xy_valid", "z_valid"].into_iter().filter_map(|name| {
        let at = at(name, FlattenedFieldType::Bool)?;
        data.get(at)
    });
    let valid = marks.into_iter().all(|mark| *mark != 0) && place.iter().all(|x| x.is_finite());
    Some((time_us, place, valid))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_log_is_said() {
        assert!(matches!(
            parse(MAGIC),
            Err(UlogError::NoPosition | UlogError::Damaged(_))
        ));
        let mut damaged = MAGIC.to_vec();
        damaged.extend([1, 0, 0, 0, 0, 0, 0, 0, 0]);
        damaged.extend([0xff; 400]);
        assert!(parse(&damaged).is_err());
    }
}
