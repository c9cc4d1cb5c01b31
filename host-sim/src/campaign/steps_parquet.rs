//! Every scored step as a row of a Parquet file, and on request what was true, measured and said there.

mod rows;

use std::io::Write;
use std::sync::Arc;

use bnkf_model_export::flights::flight::{Flight, Motion};
use bnkf_model_export::radar::reading::Reading;
use parquet::data_type::{ByteArrayType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::campaign::step_record::MethodSteps;
use crate::exchange::estimates::{COVARIANCE, POSITION};
use crate::exchange::readings::{MEASURED, TRUTHS};
use crate::parquet_columns::{column, optional, snappy};
use crate::scenario::radar::Condition;
use rows::{Rows, booleans, doubles, integers, string, text};

/// Columns in their order. Units: seconds, metres, m^6, m/s, m/s^2; `nis` is null where the method has no
/// innovation, `fate` in gaps and where the method has no gate, `tuned_on` where nothing is tuned.
const SCHEMA: &str = "
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
";

/// Rows of a group: what stands in memory at a time, besides one flight's.
const GROUP_ROWS: usize = 1 << 16;

/// The tracks of one flight under one condition.
#[derive(Clone, Debug)]
pub struct FlightTracks<'a> {
    /// The flight.
    pub flight: &'a Flight,
    /// The fold that tested it.
    pub fold: usize,
    /// What the radar said of its samples, or nothing if estimates are not written.
    pub readings: Vec<Option<Reading>>,
    /// Every method's steps.
    pub tracks: Vec<MethodSteps>,
}

/// What a row holds. Truth and reading have the columns of [`crate::exchange::readings`], estimates those of
/// [`crate::exchange::estimates`]; `mode` is
/// [`mode`](crate::campaign::step_record::StepRecord::mode).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Scores.
    Scores,
    /// And truth, reading, estimate, covariance, mode.
    Estimates,
}

/// A Parquet file under construction. Rows come ordered by condition, flight, method and time.
pub struct StepsFile<'a, W: Write + Send> {
    writer: SerializedFileWriter<W>,
    detail: Detail,
    /// The condition of the rows that are not written yet.
    condition: Option<Condition>,
    waiting: Vec<FlightTracks<'a>>,
    rows: usize,
}

impl<'a, W: Write + Send> StepsFile<'a, W> {
    /// A file without rows.
    ///
    /// # Errors
    /// `file` takes no bytes.
    pub fn new(file: W, detail: Detail) -> Result<Self, ParquetError> {
        let mut schema = format!("message step {{{SCHEMA}");
        if detail == Detail::Estimates {
            for name in TRUTHS {
                schema += &format!("required double {name};\n");
            }
            for name in MEASURED {
                schema += &format!("optional double {name};\n");
            }
            for name in POSITION.into_iter().chain(COVARIANCE) {
                schema += &format!("required double {name};\n");
            }
            schema += "required binary mode (STRING);\n";
        }
        schema += "}";
        let schema = Arc::new(parse_message_type(&schema)?);
        Ok(Self {
            writer: SerializedFileWriter::new(file, schema, Arc::new(snappy()))?,
            detail,
            condition: None,
            waiting: Vec::new(),
            rows: 0,
        })
    }

    /// Adds the rows of one flight.
    ///
    /// # Errors
    /// The file takes no more.
    pub fn add(
        &mut self,
        condition: Condition,
        flight: FlightTracks<'a>,
    ) -> Result<(), ParquetError> {
        if self.condition != Some(condition) || self.rows >= GROUP_ROWS {
            self.write_group()?;
        }
        self.condition = Some(condition);
        self.rows += flight
            .tracks
            .iter()
            .map(|own| own.steps.len())
            .sum::<usize>();
        self.waiting.push(flight);
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// It takes no more.
    pub fn finish(mut self) -> Result<W, ParquetError> {
        self.write_group()?;
        self.writer.into_inner()
    }

    /// Writes what waits as a row group.
    fn write_group(&mut self) -> Result<(), ParquetError> {
        let Some(condition) = self.condition.take() else {
            return Ok(());
        };
        let flights = std::mem::take(&mut self.waiting);
        self.rows = 0;
        let rows = Rows(&flights);
        let mut open = self.writer.next_row_group()?;
        let group = &mut open;
        text(group, &rows, |row| row.of.flight.name.clone())?;
        text(group, &rows, |row| row.of.flight.source.clone())?;
        integers(group, &rows, |row| row.of.fold as i32)?;
        text(group, &rows, |_| condition.table.to_string())?;
        text(group, &rows, |_| condition.noise.to_string())?;
        doubles(group, &rows, |_| condition.rate.get())?;
        text(group, &rows, |row| row.track.method.to_string())?;
        integers(group, &rows, |row| row.index as i32 + 1)?;
        doubles(group, &rows, |row| row.step.time_s)?;
        booleans(group, &rows, |row| row.step.in_gap)?;
        booleans(group, &rows, |row| row.step.diverged)?;
        doubles(group, &rows, |row| row.step.error_m)?;
        doubles(group, &rows, |row| row.step.mahalanobis_squared)?;
        doubles(group, &rows, |row| row.step.det_p_m6)?;
        optional::<DoubleType, W>(group, rows.map(|row| row.step.nis.map(|nis| nis.0)))?;
        let degrees = rows.map(|row| row.step.nis.map(|nis| i32::from(nis.1)));
        optional::<Int32Type, W>(group, degrees)?;
        let fates = rows.map(|row| row.step.fate.map(|fate| string(fate.label())));
        optional::<ByteArrayType, W>(group, fates)?;
        booleans(group, &rows, |row| row.step.not_tracked)?;
        booleans(group, &rows, |row| row.step.outside)?;
        let tunings = rows.map(|row| row.track.tuned_on.map(|on| string(on.label())));
        optional::<ByteArrayType, W>(group, tunings)?;
        let motion = |value: fn(&Motion) -> f64| rows.map(|row| value(&row.step.motion));
        column::<DoubleType, W>(group, motion(|motion| motion.speed_mps))?;
        column::<DoubleType, W>(group, motion(|motion| motion.acceleration_mps2))?;
        if self.detail == Detail::Estimates {
            for index in 0..TRUTHS.len() {
                doubles(group, &rows, |row| row.numbers().0[index])?;
            }
            for index in 0..MEASURED.len() {
                optional::<DoubleType, W>(group, rows.map(|row| row.numbers().1[index]))?;
            }
            for index in 0..POSITION.len() {
                doubles(group, &rows, |row| row.estimate().position_m[index])?;
            }
            for index in 0..COVARIANCE.len() {
                doubles(group, &rows, |row| row.estimate().covariance_m2[index])?;
            }
            text(group, &rows, |row| row.step.mode(row.reading()).to_owned())?;
        }
        open.close()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::{Flight, Motion};
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::{Row, RowAccessor};

    use super::{Detail, FlightTracks, GROUP_ROWS, StepsFile};
    use crate::campaign::step_record::{EstimateRecord, MethodSteps, StepRecord};
    use crate::contest::tuned_on::TunedOn;
    use crate::filter::Fate;
    use crate::method::Method;
    use crate::scenario::radar::Condition;

    fn file(detail: Detail) -> Vec<u8> {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let flight = Flight::from_track("a#1", "a.csv", &rows).unwrap();
        let step = |time_s: f64, nis: Option<(f64, u8)>| StepRecord {
            in_gap: nis.is_none(),
            fate: nis.map(|_| Fate::Rejected),
            not_tracked: nis.is_none(),
            outside: nis.is_some(),
            mahalanobis_squared: 3.5,
            det_p_m6: 1e-8,
            nis,
            motion: Motion {
                speed_mps: 2.0 * time_s,
                acceleration_mps2: 7.5,
            },
            ..StepRecord::of_test(time_s, 0.1 + time_s)
        };
        let steps = vec![step(1.0, Some((4.25, 4))), step(2.0, None)];
        let estimate = |x: f64| EstimateRecord {
            position_m: [x, 2.5, 3.5],
            covariance_m2: [4.0, 0.1, 0.2, 5.0, 0.3, 6.0],
        };
        let track = |method| MethodSteps {
            method,
            tuned_on: (method == Method::Imm5).then_some(TunedOn::Both),
            steps: steps.clone(),
            estimates: vec![estimate(1.5), estimate(2.5)],
            forecasts: Vec::new(),
        };
        let tracks = vec![track(Method::Ekf), track(Method::Imm5)];
        let radar =
            RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, SamplingRate::FULL, 1);
        let mut readings = sample_radar(&flight, &radar);
        readings[2] = None;
        let mut file = StepsFile::new(Vec::new(), detail).unwrap();
        for rate in [SamplingRate::FULL, SamplingRate::HALF] {
            let condition = Condition {
                table: NoiseTable::Printed,
                noise: NoiseLevel::High,
                rate,
            };
            let tracks = FlightTracks {
                flight: &flight,
                fold: 3,
                readings: readings.clone(),
                tracks: tracks.clone(),
            };
            file.add(condition, tracks).unwrap();
        }
        file.finish().unwrap()
    }

    fn rows(file: Vec<u8>) -> (usize, Vec<Row>) {
        let reader = SerializedFileReader::new(bytes::Bytes::from(file)).unwrap();
        let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap);
        (reader.num_row_groups(), rows.collect())
    }

    #[test]
    fn rows_come_back_as_written() {
        let (groups, rows) = rows(file(Detail::Scores));
        assert_eq!((groups, rows.len(), rows[0].len()), (2, 8, 22));
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
    fn truth_reading_estimate_and_mode_are_written_on_request() {
        let (_, rows) = rows(file(Detail::Estimates));
        assert_eq!((rows.len(), rows[0].len()), (8, 22 + 6 + 15 + 9 + 1));
        let of = |row: &Row, name: &str| {
            let mut columns = row.get_column_iter();
            columns.position(|(column, _)| column == name).unwrap()
        };
        let number = |row: &Row, name: &str| row.get_double(of(row, name)).ok();
        let mode = |row: &Row| row.get_string(of(row, "mode")).unwrap().clone();
        let (measured, gap) = (&rows[0], &rows[1]);
        assert_eq!(number(measured, "true_x_m"), Some(2.0));
        assert_eq!(number(gap, "true_x_m"), Some(3.0));
        assert_eq!(number(gap, "true_vx_mps"), Some(1.0));
        // The square root of 2^2 + 2^2 + 3^2 is 4.12; its error a few centimetres.
        assert!((number(measured, "range_m").unwrap() - 4.12).abs() < 1.0);
        assert!(number(measured, "sigma_range_m").unwrap() > 0.0);
        assert_eq!(number(gap, "range_m"), None);
        assert_eq!(number(gap, "x_m"), Some(2.5));
        assert_eq!(number(gap, "yz_m2"), Some(0.3));
        assert_eq!(
            (mode(measured), mode(gap)),
            ("rejected".into(), "coasting".into())
        );
    }

    #[test]
    fn what_waits_in_memory_is_bounded() {
        let rows = [0.0, 1.0, 2.0].map(|t| [t, 1.0 + t, 2.0, 3.0]);
        let flight = Flight::from_track("a#1", "a.csv", &rows).unwrap();
        let step = StepRecord::of_test(1.0, 1.0);
        let condition = Condition {
            table: NoiseTable::Printed,
            noise: NoiseLevel::High,
            rate: SamplingRate::FULL,
        };
        let mut file = StepsFile::new(Vec::new(), Detail::Scores).unwrap();
        for _ in 0..5 {
            let tracks = FlightTracks {
                flight: &flight,
                fold: 0,
                readings: Vec::new(),
                tracks: vec![MethodSteps {
                    method: Method::Ekf,
                    tuned_on: None,
                    steps: vec![step; GROUP_ROWS / 2],
                    estimates: Vec::new(),
                    forecasts: Vec::new(),
                }],
            };
            file.add(condition, tracks).unwrap();
            assert!(file.rows <= GROUP_ROWS);
        }
        let file = bytes::Bytes::from(file.finish().unwrap());
        let reader = SerializedFileReader::new(file).unwrap();
        let rows = reader.metadata().file_metadata().num_rows();
        assert_eq!(reader.num_row_groups(), 3);
        assert_eq!(rows, 5 * GROUP_ROWS as i64 / 2);
    }

    #[test]
    fn equal_steps_give_equal_bytes() {
        assert_eq!(file(Detail::Estimates), file(Detail::Estimates));
    }
}
