//! Estimates of anybody, read from a CSV file.
//!
//! Columns: `flight`, `noise`, `rate` and `step` as in the readings that they are of (`noise_table` too, where
//! there are two), `x_m,y_m,z_m`, and the covariance `xx_m2,xy_m2,xz_m2,yy_m2,yz_m2,zz_m2`. Others are
//! ignored.

use std::collections::HashMap;
use std::path::Path;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::track_error::COORDINATE_M_MAX;
use bnkf_model_export::scoring::step_score::StepScore;
use nalgebra::{Matrix3, Vector3};

use super::columns::{Row, Table, TableCause, TableError};
use crate::filter::PositionEstimate;
use crate::scenario::radar::Condition;

/// Columns of a position, metres.
pub const POSITION: [&str; 3] = ["x_m", "y_m", "z_m"];
/// Columns of its covariance, m^2.
pub const COVARIANCE: [&str; 6] = ["xx_m2", "xy_m2", "xz_m2", "yy_m2", "yz_m2", "zz_m2"];

/// One flight's number and one condition's.
type Track = (usize, usize);

/// Estimates of a file, by flight, condition and step.
#[derive(Clone, Debug)]
pub struct Estimates {
    /// SHA-256 of the file.
    pub sha256: String,
    /// Whether it says how sure it is.
    pub has_covariance: bool,
    of: HashMap<Track, HashMap<u64, PositionEstimate>>,
}

/// What estimates may be about.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The flights.
    pub flights: &'a [Flight],
    /// The conditions.
    pub conditions: &'a [Condition],
}

impl Subject<'_> {
    /// Steps that every estimate of the subject would be.
    pub fn steps(&self) -> usize {
        let steps = self
            .flights
            .iter()
            .map(|flight| flight.samples.len().saturating_sub(1));
        steps.sum::<usize>() * self.conditions.len()
    }
}

impl Estimates {
    /// Reads a file. Without columns of a covariance every estimate gets `sigma_m` on every axis.
    ///
    /// # Errors
    /// The file is no such table; a row is about no flight, condition or step of `subject`, or about the same as
    /// another one; a covariance is not positive definite, or there is none and no `sigma_m`.
    pub fn read(
        path: &Path,
        subject: Subject<'_>,
        sigma_m: Option<f64>,
    ) -> Result<Self, TableError> {
        let mut table = Table::open(path)?;
        let keys = Keys::of(&table, subject)?;
        let position = names(&table, POSITION)?;
        let covariance = table.group(COVARIANCE)?;
        if covariance.is_none() && sigma_m.is_none() {
            let said = "no covariance: columns xx_m2,xy_m2,xz_m2,yy_m2,yz_m2,zz_m2, or --sigma-m says how sure they are on every axis";
            return Err(table.header_fault(TableCause::Row(said.to_owned())));
        }
        let mut estimates = Self {
            sha256: table.sha256.clone(),
            has_covariance: covariance.is_some(),
            of: HashMap::new(),
        };
        while let Some(row) = table.next_row()? {
            let read = keys.track(&row, subject).and_then(|(track, step)| {
                let estimate = estimate(&row, position, covariance, sigma_m.unwrap_or(1.0))?;
                let own = estimates.of.entry(track).or_default();
                match own.insert(step, estimate) {
                    None => Ok(()),
                    Some(_) => Err(TableCause::Row(
                        "a second estimate of the same flight, condition and step".to_owned(),
                    )),
                }
            });
            read.map_err(|cause| table.fault(Some(row.line), cause))?;
        }
        Ok(estimates)
    }

    /// How many there are, the flights' first samples left out, which nobody is scored at.
    pub fn scored(&self) -> usize {
        let steps = self.of.values().flat_map(HashMap::keys);
        steps.filter(|step| **step > 0).count()
    }

    /// The estimate of a step, if there is one.
    pub fn at(&self, flight: usize, condition: usize, step: u64) -> Option<&PositionEstimate> {
        self.of.get(&(flight, condition))?.get(&step)
    }
}

/// Places of the columns that say what a row is about.
struct Keys {
    flight: usize,
    noise_table: Option<usize>,
    noise: usize,
    rate: usize,
    step: usize,
    numbers: HashMap<String, usize>,
}

impl Keys {
    fn of(table: &Table, subject: Subject<'_>) -> Result<Self, TableError> {
        let first = subject.conditions.first();
        let is_one_table = subject
            .conditions
            .iter()
            .all(|c| Some(c.table) == first.map(|f| f.table));
        let numbers = subject.flights.iter().enumerate();
        Ok(Self {
            flight: table.column("flight")?,
            noise_table: if is_one_table {
                table.find("noise_table")
            } else {
                Some(table.column("noise_table")?)
            },
            noise: table.column("noise")?,
            rate: table.column("rate")?,
            step: table.column("step")?,
            numbers: numbers
                .map(|(number, flight)| (flight.name.clone(), number))
                .collect(),
        })
    }

    fn track(&self, row: &Row, subject: Subject<'_>) -> Result<(Track, u64), TableCause> {
        let unknown = |what: String| {
            TableCause::Row(format!(
                "{what}: not what was measured with these arguments"
            ))
        };
        let name = row.text(self.flight);
        let flight = self.numbers.get(name).copied();
        let flight = flight.ok_or_else(|| unknown(format!("flight {name:?}")))?;
        let rate = row.number(self.rate, "rate")?;
        let is_meant = |condition: &Condition| {
            condition.noise.to_string() == row.word(self.noise)
                && (condition.rate.get() - rate).abs() < 1e-9
                && self
                    .noise_table
                    .is_none_or(|at| condition.table.to_string() == row.word(at))
        };
        let condition = subject.conditions.iter().position(is_meant);
        let condition = condition
            .ok_or_else(|| unknown(format!("noise {:?} at rate {rate}", row.word(self.noise))))?;
        let step = row.count(self.step, "step")?;
        if step >= subject.flights[flight].samples.len() as u64 {
            return Err(unknown(format!("step {step} of flight {name:?}")));
        }
        Ok(((flight, condition), step))
    }
}

fn names<const N: usize>(
    table: &Table,
    names: [&'static str; N],
) -> Result<[usize; N], TableError> {
    let mut places = [0; N];
    for (place, name) in places.iter_mut().zip(names) {
        *place = table.column(name)?;
    }
    Ok(places)
}

fn estimate(
    row: &Row,
    position: [usize; 3],
    covariance: Option<[usize; 6]>,
    sigma_m: f64,
) -> Result<PositionEstimate, TableCause> {
    let mut position_m = Vector3::zeros();
    for (axis, column) in position.into_iter().enumerate() {
        position_m[axis] = row.number(column, POSITION[axis])?;
    }
    let covariance_m2 = match covariance {
        None => Matrix3::identity() * sigma_m * sigma_m,
        Some(columns) => {
            let mut p = [0.0; 6];
            for (index, column) in columns.into_iter().enumerate() {
                p[index] = row.number(column, COVARIANCE[index])?;
            }
            let [xx, xy, xz, yy, yz, zz] = p;
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    if position_m.amax() > COORDINATE_M_MAX {
        let said = format!("a coordinate beyond +-{COORDINATE_M_MAX} m");
        return Err(TableCause::Row(said));
    }
    // What no score can be made of would silently count as a divergence.
    if StepScore::new(&position_m, &covariance_m2, &position_m).is_err() {
        let diagonal = covariance_m2.diagonal();
        let said = if diagonal.min() > 0.0 && diagonal.product().is_infinite() {
            "the covariance is so large that its determinant is no number"
        } else {
            "the covariance is not positive definite, or its determinant is too small for a number"
        };
        return Err(TableCause::Row(said.to_owned()));
    }
    Ok(PositionEstimate::new(position_m, covariance_m2))
}
