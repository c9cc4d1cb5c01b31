//! Every scored step as a row of a Parquet file.

use std::sync::Arc;

use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use bnkf_model_export::flights::flight::{Flight, Motion};

use crate::campaign::step_record::{MethodSteps, StepRecord};
use crate::parquet_columns::{Group, column, optional, snappy};
use crate::scenario::radar::Condition;

/// Columns in their order. Units: seconds, metres, m^6, m/s, m/s^2; `nis` is null where the method has no
/// innovation, `fate` in gaps and where the method has no gate, `tuned_on` where nothing is tuned.
const SCHEMA: &str = "message step {
    required binary flight (STRING);
    required binary source (STRING);
    required int32 fold;
    required binary noise_table (STRING);
    required binary noise (STRING);
    required double rate;
    required binary method (STRING);
    required int32 step;
    required double time_s;
    required boolean in_gap;
    required boolean diverged;
    required double error_m;
    required double mahalanobis_squared;
    required double det_p_m6;
    optional double nis;
    optional int32 nis_degrees;
    optional binary fate (STRING);
    required boolean not_tracked;
    required boolean outside;
    optional binary tuned_on (STRING);
    required double true_speed_mps;
    required double true_acceleration_mps2;
}";

/// The tracks of one flight under one condition.
#[derive(Clone, Debug)]
pub struct FlightTracks<'a> {
    /// The flight.
    pub flight: &'a Flight,
    /// The fold that tested it.
    pub fold: usize,
    /// Every method's steps.
    pub tracks: Vec<MethodSteps>,
}

/// A Parquet file under construction, in memory.
pub struct StepsFile {
    writer: SerializedFileWriter<Vec<u8>>,
}

impl StepsFile {
    /// A file without rows.
    ///
    /// # Errors
    /// None is expected: the schema is a constant that is tested.
    pub fn new() -> Result<Self, ParquetError> {
        let schema = Arc::new(parse_message_type(SCHEMA)?);
        let writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(snappy()))?;
        Ok(Self { writer })
    }

    /// Adds a row group: all steps under one condition, ordered by flight, method and time.
    ///
    /// # Errors
    /// None is expected: the file is in memory.
    pub fn add(
        &mut self,
        condition: Condition,
        flights: &[FlightTracks<'_>],
    ) -> Result<(), ParquetError> {
        let rows = Rows(flights);
        let mut group = self.writer.next_row_group()?;
        text(&mut group, &rows, |row| row.of.flight.name.clone())?;
        text(&mut group, &rows, |row| row.of.flight.source.clone())?;
        column::<Int32Type>(&mut group, rows.map(|row| row.of.fold as i32))?;
        text(&mut group, &rows, |_| condition.table.to_string())?;
        text(&mut group, &rows, |_| condition.noise.to_string())?;
        column::<DoubleType>(&mut group, rows.map(|_| condition.rate.get()))?;
        text(&mut group, &rows, |row| row.track.method.to_string())?;
        column::<Int32Type>(&mut group, rows.map(|row| row.index as i32 + 1))?;
        column::<DoubleType>(&mut group, rows.map(|row| row.step.time_s))?;
        column::<BoolType>(&mut group, rows.map(|row| row.step.in_gap))?;
        column::<BoolType>(&mut group, rows.map(|row| row.step.diverged))?;
        column::<DoubleType>(&mut group, rows.map(|row| row.step.error_m))?;
        column::<DoubleType>(&mut group, rows.map(|row| row.step.mahalanobis_squared))?;
        column::<DoubleType>(&mut group, rows.map(|row| row.step.det_p_m6))?;
        optional::<DoubleType>(&mut group, rows.map(|row| row.step.nis.map(|nis| nis.0)))?;
        optional::<Int32Type>(
            &mut group,
            rows.map(|row| row.step.nis.map(|nis| i32::from(nis.1))),
        )?;
        let string = |text: &str| ByteArray::from(text.as_bytes().to_vec());
        let fates = rows.map(|row| row.step.fate.map(|fate| string(fate.label())));
        optional::<ByteArrayType>(&mut group, fates)?;
        column::<BoolType>(&mut group, rows.map(|row| row.step.not_tracked))?;
        column::<BoolType>(&mut group, rows.map(|row| row.step.outside))?;
        let tunings = rows.map(|row| row.track.tuned_on.map(|on| string(on.label())));
        optional::<ByteArrayType>(&mut group, tunings)?;
        let motion = |value: fn(&Motion) -> f64| rows.map(|row| value(&row.step.motion));
        column::<DoubleType>(&mut group, motion(|motion| motion.speed_mps))?;
        column::<DoubleType>(&mut group, motion(|motion| motion.acceleration_mps2))?;
        group.close()?;
        Ok(())
    }

    /// The bytes of the whole file.
    ///
    /// # Errors
    /// None is expected: the file is in memory.
    pub fn finish(self) -> Result<Vec<u8>, ParquetError> {
        self.writer.into_inner()
    }
}

struct Rows<'a>(&'a [FlightTracks<'a>]);

/// One row and what it belongs to.
struct Row<'a> {
    of: &'a FlightTracks<'a>,
    track: &'a MethodSteps,
    index: usize,
    step: &'a StepRecord,
}

impl Rows<'_> {
    fn map<T>(&self, value: impl Fn(Row<'_>) -> T) -> Vec<T> {
        let mut values = Vec::new();
        for of in self.0 {
            for track in &of.tracks {
                for (index, step) in track.steps.iter().enumerate() {
                    values.push(value(Row {
                        of,
                        track,
                        index,
                        step,
                    }));
                }
            }
        }
        values
    }
}

fn text(
    group: &mut Group<'_>,
    rows: &Rows<'_>,
    value: impl Fn(Row<'_>) -> String,
) -> Result<(), ParquetError> {
    column::<ByteArrayType>(
        group,
        rows.map(|row| ByteArray::from(value(row).into_bytes())),
    )
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::{Flight, Motion};
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    use super::{FlightTracks, StepsFile};
    use crate::campaign::step_record::{MethodSteps, StepRecord};
    use crate::contest::tuned_on::TunedOn;
    use crate::filter::Fate;
    use crate::method::Method;
    use crate::scenario::radar::Condition;

    fn file() -> Vec<u8> {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let flight = Flight::from_track("a#1", "a.csv", &rows).unwrap();
        let step = |time_s: f64, nis: Option<(f64, u8)>| StepRecord {
            time_s,
            in_gap: nis.is_none(),
            diverged: false,
            fate: nis.map(|_| Fate::Rejected),
            not_tracked: nis.is_none(),
            outside: nis.is_some(),
            error_m: 0.1 + time_s,
            mahalanobis_squared: 3.5,
            det_p_m6: 1e-8,
            nis,
            motion: Motion {
                speed_mps: 2.0 * time_s,
                acceleration_mps2: 7.5,
            },
        };
        let steps = vec![step(1.0, Some((4.25, 4))), step(2.0, None)];
        let track = |method| MethodSteps {
            method,
            tuned_on: (method == Method::Imm5).then_some(TunedOn::Both),
            steps: steps.clone(),
            forecasts: Vec::new(),
        };
        let tracks = vec![track(Method::Ekf), track(Method::Imm5)];
        let mut file = StepsFile::new().unwrap();
        for rate in [SamplingRate::FULL, SamplingRate::HALF] {
            let condition = Condition {
                table: NoiseTable::Printed,
                noise: NoiseLevel::High,
                rate,
            };
            file.add(
                condition,
                &[FlightTracks {
                    flight: &flight,
                    fold: 3,
                    tracks: tracks.clone(),
                }],
            )
            .unwrap();
        }
        file.finish().unwrap()
    }

    #[test]
    fn rows_come_back_as_written() {
        let reader = SerializedFileReader::new(bytes::Bytes::from(file())).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let rows: Vec<_> = reader
            .get_row_iter(None)
            .unwrap()
            .map(Result::unwrap)
            .collect();
        assert_eq!(rows.len(), 8);
        let last = &rows[7];
        assert_eq!(last.get_string(0).unwrap(), "a#1");
        assert_eq!(last.get_string(1).unwrap(), "a.csv");
        assert_eq!(last.get_int(2).unwrap(), 3);
        assert_eq!(last.get_string(3).unwrap(), "printed");
        assert_eq!(last.get_string(4).unwrap(), "high");
        assert_eq!(last.get_double(5).unwrap(), 0.5);
        assert_eq!(last.get_string(6).unwrap(), "IMM5");
        assert_eq!(last.get_int(7).unwrap(), 2);
        assert_eq!(last.get_double(8).unwrap(), 2.0);
        assert!(last.get_bool(9).unwrap());
        assert_eq!(last.get_double(11).unwrap(), 2.1);
        assert!(last.get_double(14).is_err(), "a gap has no innovation");
        assert_eq!(rows[6].get_double(14).unwrap(), 4.25);
        assert_eq!(rows[6].get_int(15).unwrap(), 4);
        assert_eq!(rows[6].get_string(16).unwrap(), "rejected");
        assert!(last.get_string(16).is_err(), "a gap has no reading");
        assert!(last.get_bool(17).unwrap());
        assert!(rows[6].get_bool(18).unwrap() && !last.get_bool(18).unwrap());
        assert_eq!(last.get_string(19).unwrap(), "both");
        assert!(rows[0].get_string(19).is_err(), "nothing was tuned");
        assert_eq!(last.get_double(20).unwrap(), 4.0);
        assert_eq!(last.get_double(21).unwrap(), 7.5);
    }

    #[test]
    fn equal_steps_give_equal_bytes() {
        assert_eq!(file(), file());
    }
}
