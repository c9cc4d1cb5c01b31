//! ArduPilot's log: positions of its EKF (`XKF1`, core 0; before that `NKF1`), or where there is none of `POS`.

use std::io::Cursor;

use ardupilot_binlog::{Entry, Reader};

use super::geodetic::Geodetic;
use super::ulog::Rows;

/// First bytes of every such file: the definition of definitions.
pub const MAGIC: &[u8] = &[0xA3, 0x95, 0x80];

/// Why a log holds no flight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DataflashError {
    /// No message with a position.
    #[error("an ArduPilot log without a position: none of the messages XKF1, NKF1 and POS")]
    NoPosition,
}

/// The positions in `bytes`. A log that breaks off gives what came before.
///
/// # Errors
/// See [`DataflashError`].
pub fn parse(bytes: &[u8]) -> Result<Rows, DataflashError> {
    let mut ekf3 = Vec::new();
    let mut ekf2 = Vec::new();
    let mut places = Vec::new();
    let mut notes = Vec::new();
    for entry in Reader::new(Cursor::new(bytes)) {
        let Ok(entry) = entry else {
            notes.push(
                "the log breaks off with a damaged message; what came before was read".to_owned(),
            );
            break;
        };
        match entry.name.as_str() {
            "XKF1" => ekf3.extend(local(&entry)),
            "NKF1" => ekf2.extend(local(&entry)),
            "POS" => places.extend(global(&entry)),
            _ => {}
        }
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

/// Seconds since the boot.
fn time_s(entry: &Entry) -> Option<f64> {
    entry.timestamp_usec.map(|time_us| 1e-6 * time_us as f64)
}

/// Seconds, and east, north, up of the first core.
fn local(entry: &Entry) -> Option<[f64; 4]> {
    let is_first_core = entry.get_f64("C").is_none_or(|core| core == 0.0);
    let [north, east, down] = [
        entry.get_f64("PN"),
        entry.get_f64("PE"),
        entry.get_f64("PD"),
    ];
    is_first_core.then_some([time_s(entry)?, east?, north?, -down?])
}

/// Seconds and place; latitude and longitude are logged in ten millionths of a degree.
fn global(entry: &Entry) -> Option<(f64, Geodetic)> {
    let place = Geodetic {
        latitude_deg: 1e-7 * entry.get_f64("Lat")?,
        longitude_deg: 1e-7 * entry.get_f64("Lng")?,
        height_m: entry.get_f64("Alt")?,
    };
    place.is_a_place().then_some((time_s(entry)?, place))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_no_position_is_said() {
        assert_eq!(parse(MAGIC), Err(DataflashError::NoPosition));
        assert_eq!(parse(&[0xA3; 500]), Err(DataflashError::NoPosition));
    }
}
