//! The full evaluation: cross-validated, resumable, and the same bytes however often it was killed.

pub mod cell_summary;
pub mod comparison;
mod example_runs;
pub mod fold_kit;
pub mod generalisation;
pub mod outcome;
pub mod step_record;
pub mod steps_parquet;
pub mod variation;
pub mod work_folder;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::GeneratorError;
use bnkf_model_export::radar::noise::NoiseTable;
use parquet::errors::ParquetError;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::campaign::step_record::{MethodSteps, StepRecord};
use crate::campaign::steps_parquet::{FlightTracks, StepsFile};
use crate::contest::fold::Folds;
use crate::contest::model::Model;
use crate::contest::roster::{Roster, RosterError, Supplies};
use crate::contest::runs::Runs;
use crate::contest::track::TrackStep;
use crate::method::Method;
use crate::scenario::Scenario;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::FlightSum;
use fold_kit::{FoldKit, FoldKitError, Part, Task};
use outcome::{Block, Outcome, clusters};
use work_folder::{WorkFolder, WorkFolderError};

/// What is evaluated, and how.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Radar and flights.
    pub scenario: Scenario,
    /// Flights, cut and placed, run after run.
    pub runs: Runs,
    /// Their division.
    pub folds: Folds,
    /// The methods.
    pub methods: Vec<Method>,
    /// Monte Carlo passes, if not the models' own number.
    pub passes: Option<u16>,
    /// Training epochs of the networks.
    pub epochs: u32,
    /// Seed of everything random.
    pub seed: u64,
    /// Models that no fold trains, of kinds of their own.
    pub shipped: Vec<Model>,
}

/// What is kept of one flight under one condition.
#[derive(Serialize, Deserialize)]
struct Unit {
    tracks: Vec<MethodSteps>,
    /// Sum of the bound over the scored steps, metres.
    floor_m: Option<FlightSum>,
}

/// Why a campaign failed.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// A fold's models or tunings.
    #[error("fold {fold}, {table}: {cause}")]
    Kit {
        /// The fold.
        fold: usize,
        /// The noise table.
        table: NoiseTable,
        /// What went wrong.
        cause: FoldKitError,
    },
    /// A method cannot run.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// A piece cannot be kept.
    #[error(transparent)]
    Work(#[from] WorkFolderError),
    /// Flights of another world cannot be generated.
    #[error("generated flights: {0}")]
    Generator(#[from] GeneratorError),
    /// The rows cannot be written.
    #[error("steps.parquet: {0}")]
    Parquet(#[from] ParquetError),
}

/// What a campaign tells while it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// A stage of so many pieces begins.
    Stage(&'static str, usize),
    /// So many thousandths of a piece are done.
    Advance(u64),
}

/// Who is told.
pub type Watcher<'a> = &'a (dyn Fn(Progress) + Sync);

impl Campaign {
    /// Makes every piece that `work` lacks, then sums up.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn run(&self, work: &WorkFolder, watcher: Watcher<'_>) -> Result<Outcome, CampaignError> {
        let conditions = self.scenario.radar.conditions();
        let kits = self.kits(work, watcher)?;
        self.units(&conditions, &kits, work, watcher)?;
        let variations = self.generalise(&kits[0][0], work, watcher)?;
        watcher(Progress::Stage("Summing up", conditions.len()));
        let (cluster, clusters) = clusters(&self.runs);
        let mut steps = StepsFile::new()?;
        let (mut cells, mut pairs, mut floors) = (Vec::new(), Vec::new(), Vec::new());
        for (number, condition) in conditions.iter().enumerate() {
            let (flights, flight_floors) = self.finished(work, number)?;
            let block = Block {
                condition: *condition,
                flights: &flights,
                floors: &flight_floors,
                clusters: &clusters,
                methods: &self.methods,
                folds: self.folds.count,
                seed: self.seed,
            };
            let (own_cells, own_pairs, floor) = block.sum_up();
            cells.extend(own_cells);
            pairs.extend(own_pairs);
            floors.push(floor);
            steps.add(*condition, &flights)?;
            watcher(Progress::Advance(1000));
        }
        Ok(Outcome {
            cells,
            comparisons: pairs,
            variations,
            floors,
            cluster,
            parquet: steps.finish()?,
        })
    }

    /// Supplies of every (table, fold), in the order of the scenario's tables.
    fn kits(
        &self,
        work: &WorkFolder,
        watcher: Watcher<'_>,
    ) -> Result<Vec<Vec<FoldKit>>, CampaignError> {
        let tables = &self.scenario.radar.tables;
        let training: Vec<Vec<&Flight>> = (0..self.folds.count)
            .map(|fold| self.folds.training(self.runs.first(), fold))
            .collect();
        let task = |table: NoiseTable, fold: usize| Task {
            fold,
            table,
            flights: &training[fold],
            radar: &self.scenario.radar,
            epochs: self.epochs,
            seed: self.seed,
        };
        let failed = |task: &Task<'_>, cause| CampaignError::Kit {
            fold: task.fold,
            table: task.table,
            cause,
        };
        let tasks: Vec<_> = tables
            .iter()
            .flat_map(|table| (0..self.folds.count).map(|fold| task(*table, fold)))
            .collect();
        let needed = Part::needed(&self.methods);
        let parts: Vec<_> = tasks
            .iter()
            .flat_map(|task| needed.iter().map(move |part| (task, *part)))
            .collect();
        watcher(Progress::Stage("Tuning and training", parts.len()));
        parts.par_iter().try_for_each(|(task, part)| {
            let told = std::cell::Cell::new(0);
            let done = |share: f64| {
                let thousandths = (share * 1000.0) as u64;
                watcher(Progress::Advance(thousandths - told.get()));
                told.set(thousandths);
            };
            task.make(*part, work, &done)
                .map_err(|cause| failed(task, cause))
        })?;
        let kit = |table: &NoiseTable| {
            let kits = (0..self.folds.count).map(|fold| {
                let task = task(*table, fold);
                let mut kit = task
                    .kit(&needed, work)
                    .map_err(|cause| failed(&task, cause))?;
                kit.models.extend(self.shipped.iter().cloned());
                Ok(kit)
            });
            kits.collect::<Result<Vec<_>, _>>()
        };
        tables.iter().map(kit).collect()
    }

    /// Runs every method over every flight under every condition.
    fn units(
        &self,
        conditions: &[Condition],
        kits: &[Vec<FoldKit>],
        work: &WorkFolder,
        watcher: Watcher<'_>,
    ) -> Result<(), CampaignError> {
        let count = conditions.len() * self.runs.flights.len();
        watcher(Progress::Stage("Evaluating", count));
        (0..count).into_par_iter().try_for_each(|unit| {
            let (number, flight) = (
                unit / self.runs.flights.len(),
                unit % self.runs.flights.len(),
            );
            let name = unit_name(number, flight);
            if work.bytes(&name)?.is_none() {
                let condition = conditions[number];
                let tables = &self.scenario.radar.tables;
                let table = tables.iter().position(|table| *table == condition.table);
                let kit =
                    &kits[table.expect("a table of the scenario")][self.folds.of_flight[flight]];
                work.store(
                    &name,
                    &self.unit(kit, &self.runs.flights[flight], condition)?,
                )?;
            }
            watcher(Progress::Advance(1000));
            Ok(())
        })
    }

    /// The methods with what `kit` holds.
    fn roster<'a>(&self, kit: &'a FoldKit) -> Result<Roster<'a>, RosterError> {
        let supplies = Supplies {
            models: &kit.models,
            passes: self.passes,
            tunings: kit.tunings.as_ref(),
        };
        Roster::new(&self.methods, supplies)
    }

    fn unit(
        &self,
        kit: &FoldKit,
        flight: &Flight,
        condition: Condition,
    ) -> Result<Unit, RosterError> {
        let readings = self.scenario.radar.readings(flight, condition, self.seed);
        let tracks = self
            .roster(kit)?
            .tracks(flight, &readings, condition, self.seed);
        let records = |(method, steps): (Method, Vec<TrackStep>)| MethodSteps {
            method,
            steps: steps.iter().map(StepRecord::from).collect(),
        };
        Ok(Unit {
            tracks: tracks.into_iter().map(records).collect(),
            floor_m: kit
                .tunings
                .as_ref()
                .and_then(|tunings| tunings.floor_m(flight, &readings, condition)),
        })
    }

    /// The finished units of one condition, in the flights' order: tracks and bounds.
    fn finished(
        &self,
        work: &WorkFolder,
        condition: usize,
    ) -> Result<(Vec<FlightTracks<'_>>, Vec<Option<FlightSum>>), WorkFolderError> {
        let (mut tracks, mut floors) = (Vec::new(), Vec::new());
        for (index, flight) in self.runs.flights.iter().enumerate() {
            let unit: Unit = work
                .load(&unit_name(condition, index))?
                .expect("made before");
            tracks.push(FlightTracks {
                flight,
                fold: self.folds.of_flight[index],
                tracks: unit.tracks,
            });
            floors.push(unit.floor_m);
        }
        Ok((tracks, floors))
    }
}

fn unit_name(condition: usize, flight: usize) -> String {
    format!("unit-{condition:03}-{flight:06}")
}
