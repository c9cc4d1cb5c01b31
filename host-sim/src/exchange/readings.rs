//! Truth and readings as a table: one row for every sample of every flight under every condition.
//!
//! The names of columns carry the units: metres, seconds, radians, metres per second; x east, y north, z
//! up. What was not measured is empty (null).

use std::io::Write;
use std::sync::Arc;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::time_us;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::csv_text;
use crate::parquet_columns::{column, optional, snappy};
use crate::scenario::radar::Condition;

/// What identifies a row, in CSV and Parquet alike.
const KEYS: [&str; 6] = ["flight", "noise_table", "noise", "rate", "step", "time_us"];
/// Numbers that every row has.
pub const TRUTHS: [&str; 6] = [
    "true_x_m",
    "true_y_m",
    "true_z_m",
    "true_vx_mps",
    "true_vy_mps",
    "true_vz_mps",
];
/// Numbers that a row with a reading may have.
pub const MEASURED: [&str; 15] = [
    "range_m",
    "elevation_rad",
    "azimuth_rad",
    "range_rate_mps",
    "sigma_range_m",
    "sigma_elevation_rad",
    "sigma_azimuth_rad",
    "sigma_range_rate_mps",
    "sensor_x_m",
    "sensor_y_m",
    "sensor_z_m",
    "sensor_vx_mps",
    "sensor_vy_mps",
    "sensor_vz_mps",
    "late_s",
];

/// One flight under one condition.
#[derive(Clone, Debug)]
pub struct Sighting<'a> {
    /// The flight.
    pub flight: &'a Flight,
    /// Noise and rate.
    pub condition: Condition,
    /// One entry per sample.
    pub readings: Vec<Option<Reading>>,
}

/// The columns' names, in order.
pub fn header() -> Vec<&'static str> {
    KEYS.into_iter().chain(TRUTHS).chain(MEASURED).collect()
}

/// The rows of `sightings` as CSV lines without a header.
pub fn csv_rows(sighting: &Sighting<'_>) -> impl Iterator<Item = Vec<String>> {
    let Condition { table, noise, rate } = sighting.condition;
    rows(sighting).map(move |(step, time_us, truth, measured)| {
        let mut fields = vec![
            sighting.flight.name.clone(),
            table.to_string(),
            noise.to_string(),
            rate.to_string(),
            step.to_string(),
            time_us.to_string(),
        ];
        fields.extend(truth.map(csv_text::number));
        fields.extend(measured.map(|number| number.map_or(String::new(), csv_text::number)));
        fields
    })
}

/// Numbers of a row, in the order of [`TRUTHS`] and [`MEASURED`].
pub type Numbers = ([f64; TRUTHS.len()], [Option<f64>; MEASURED.len()]);

/// Step, time, truth and reading of every sample.
fn rows(
    sighting: &Sighting<'_>,
) -> impl Iterator<
    Item = (
        usize,
        u64,
        [f64; TRUTHS.len()],
        [Option<f64>; MEASURED.len()],
    ),
> {
    let samples = sighting.flight.samples.iter().zip(&sighting.readings);
    samples.enumerate().map(|(step, (sample, reading))| {
        let (truth, measured) = numbers(sample.position_m, sample.velocity_mps, reading.as_ref());
        (
            step,
            time_us(sighting.flight, sample.time_s),
            truth,
            measured,
        )
    })
}

/// The numbers of a row: a sample's position (m) and velocity (m/s), and what was measured of it.
pub fn numbers(p: [f64; 3], v: [f64; 3], reading: Option<&Reading>) -> Numbers {
    let truth = [p[0], p[1], p[2], v[0], v[1], v[2]];
    let Some(reading) = reading else {
        return (truth, [None; MEASURED.len()]);
    };
    let [x, y, z] = reading.sensor.position_m;
    let [vx, vy, vz] = reading.sensor.velocity_mps;
    let measured = [
        reading.range_m,
        reading.elevation_rad,
        reading.azimuth_rad,
        reading.range_rate_mps,
        reading.sigma_range_m,
        reading.sigma_elevation_rad,
        reading.sigma_azimuth_rad,
        reading.sigma_range_rate_mps,
        x,
        y,
        z,
        vx,
        vy,
        vz,
        1e-6 * reading.late_us as f64,
    ];
    // Of a channel that was not measured nothing is a number.
    (
        truth,
        measured.map(|number| (!number.is_nan()).then_some(number)),
    )
}

/// A Parquet file of the same columns under construction.
pub struct ReadingsFile<W: Write + Send> {
    writer: SerializedFileWriter<W>,
}

impl<W: Write + Send> ReadingsFile<W> {
    /// A file without rows.
    ///
    /// # Errors
    /// `file` takes no bytes.
    pub fn new(file: W) -> Result<Self, ParquetError> {
        let mut schema = String::from("message reading {\n");
        for name in ["flight", "noise_table", "noise"] {
            schema += &format!("required binary {name} (STRING);\n");
        }
        schema += "required double rate;\nrequired int64 step;\nrequired int64 time_us;\n";
        for name in TRUTHS {
            schema += &format!("required double {name};\n");
        }
        for name in MEASURED {
            schema += &format!("optional double {name};\n");
        }
        schema += "}";
        let schema = Arc::new(parse_message_type(&schema)?);
        let writer = SerializedFileWriter::new(file, schema, Arc::new(snappy()))?;
        Ok(Self { writer })
    }

    /// Adds a row group.
    ///
    /// # Errors
    /// The file takes no more.
    pub fn add(&mut self, sightings: &[Sighting<'_>]) -> Result<(), ParquetError> {
        let all: Vec<_> = sightings
            .iter()
            .flat_map(|sighting| rows(sighting).map(move |row| (sighting, row)))
            .collect();
        let string = |text: String| ByteArray::from(text.into_bytes());
        let mut group = self.writer.next_row_group()?;
        let names = all.iter().map(|(of, _)| string(of.flight.name.clone()));
        column::<ByteArrayType, _>(&mut group, names.collect())?;
        let tables = all
            .iter()
            .map(|(of, _)| string(of.condition.table.to_string()));
        column::<ByteArrayType, _>(&mut group, tables.collect())?;
        let levels = all
            .iter()
            .map(|(of, _)| string(of.condition.noise.to_string()));
        column::<ByteArrayType, _>(&mut group, levels.collect())?;
        let rates = all.iter().map(|(of, _)| of.condition.rate.get());
        column::<DoubleType, _>(&mut group, rates.collect())?;
        column::<Int64Type, _>(
            &mut group,
            all.iter().map(|(_, row)| row.0 as i64).collect(),
        )?;
        column::<Int64Type, _>(
            &mut group,
            all.iter().map(|(_, row)| row.1 as i64).collect(),
        )?;
        for index in 0..TRUTHS.len() {
            column::<DoubleType, _>(
                &mut group,
                all.iter().map(|(_, row)| row.2[index]).collect(),
            )?;
        }
        for index in 0..MEASURED.len() {
            optional::<DoubleType, _>(
                &mut group,
                all.iter().map(|(_, row)| row.3[index]).collect(),
            )?;
        }
        group.close()?;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// It takes no more.
    pub fn finish(self) -> Result<W, ParquetError> {
        self.writer.into_inner()
    }
}
