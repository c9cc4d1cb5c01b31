//! The full evaluation: cross-validated, resumable, and the same bytes however often it was killed.

pub mod cell_summary;
pub mod comparison;
mod example_runs;
pub mod fold_kit;
pub mod forecast_summary;
pub mod generalisation;
pub mod outcome;
pub mod step_record;
pub mod steps_parquet;
pub mod tuning_choice;
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
use crate::contest::own_filter::OwnFilter;
use crate::contest::roster::{Roster, RosterError, Supplies};
use crate::contest::runs::Runs;
use crate::contest::tuned_on::TunedOn;
use crate::contest::tunings::Tunings;
use crate::method::Method;
use crate::scenario::Scenario;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::FlightSum;
use fold_kit::{FoldKit, FoldKitError, Part, Task};
use outcome::{Block, Outcome, clusters};
use tuning_choice::{choose, chosen, keep_chosen};
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
    /// Generated flights to tune on; none of them is evaluated.
    pub to_tune_on: Vec<Flight>,
    /// What tuned filters are fitted to; each cell shows the best of these.
    pub tuned_on: Vec<TunedOn>,
    /// Monte Carlo passes, if not the models' own number.
    pub passes: Option<u16>,
    /// Training epochs of the networks.
    pub epochs: u32,
    /// Seed of everything random.
    pub seed: u64,
    /// Models that no fold trains, of kinds of their own.
    pub shipped: Vec<Model>,
    /// Methods from outside, which `methods` name.
    pub own: Vec<OwnFilter>,
}

/// What is kept of one flight under one condition.
#[derive(Serialize, Deserialize)]
struct Unit {
    tracks: Vec<MethodSteps>,
    /// Sum of the bound over the scored steps, metres, of every motion model.
    floors_m: Floors,
}

type Floors = Vec<(TunedOn, Option<FlightSum>)>;

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
        let (mut forecasts, mut forecast_pairs) = (Vec::new(), Vec::new());
        let mut candidates = Vec::new();
        for (number, condition) in conditions.iter().enumerate() {
            let (mut flights, flight_floors) = self.finished(work, number)?;
            let own_candidates = choose(*condition, &self.methods, &flights);
            keep_chosen(&own_candidates, *condition, &self.methods, &mut flights);
            let shown = |method| chosen(&own_candidates, method, *condition);
            // The bound of the model that the tuned EKF is shown with.
            let flight_floors: Vec<Option<FlightSum>> = flight_floors
                .iter()
                .map(|floors| {
                    let on = shown(Method::EkfTuned).unwrap_or(TunedOn::Generated);
                    floors.iter().find(|(of, _)| *of == on)?.1
                })
                .collect();
            let block = Block {
                condition: *condition,
                flights: &flights,
                floors: &flight_floors,
                clusters: &clusters,
                methods: &self.methods,
                candidates: &own_candidates,
                folds: self.folds.count,
                seed: self.seed,
            };
            let (own_cells, own_pairs, floor) = block.sum_up();
            let (own_forecasts, own_forecast_pairs) = block.sum_up_forecasts();
            forecasts.extend(own_forecasts);
            forecast_pairs.extend(own_forecast_pairs);
            cells.extend(own_cells);
            pairs.extend(own_pairs);
            floors.push(floor);
            steps.add(*condition, &flights)?;
            candidates.extend(own_candidates);
            watcher(Progress::Advance(1000));
        }
        Ok(Outcome {
            cells,
            comparisons: pairs,
            forecasts,
            forecast_comparisons: forecast_pairs,
            candidates,
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
            generated: &self.to_tune_on,
            recursive: self.shipped.last(),
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
        let needed = Part::needed(&self.methods, &self.tuned_on);
        let parts: Vec<_> = tasks
            .iter()
            .flat_map(|task| needed.iter().map(move |part| (task, *part)))
            .filter(|(task, part)| part.is_of_a_fold() || task.fold == 0)
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

    /// Those of `methods` that run with the parameters of `tuned_on`; the others run once, with the
    /// first of the campaign's.
    fn roster<'a>(
        &'a self,
        kit: &'a FoldKit,
        tuned_on: TunedOn,
        methods: &[Method],
    ) -> Result<Roster<'a>, RosterError> {
        let is_first = self.tuned_on.first() == Some(&tuned_on);
        let own: Vec<Method> = methods
            .iter()
            .copied()
            .filter(|method| is_first || method.is_tuned())
            .collect();
        let tunings = kit.tunings.iter().find(|(on, _)| *on == tuned_on);
        let supplies = Supplies {
            models: &kit.models,
            passes: self.passes,
            tunings: tunings.map(|(_, tunings)| tunings),
            tuned: kit.tuned.as_ref(),
            own: &self.own,
        };
        Roster::new(&own, supplies)
    }

    /// The methods that can fly other flights than those of the campaign.
    fn live_methods(&self) -> Vec<Method> {
        let is_recorded = |method: &Method| {
            let own = self.own.iter().find(|own| own.method() == *method);
            own.is_some_and(|own| own.recorded_sha256().is_some())
        };
        let live = self.methods.iter().filter(|method| !is_recorded(method));
        live.copied().collect()
    }

    fn unit(
        &self,
        kit: &FoldKit,
        flight: &Flight,
        condition: Condition,
    ) -> Result<Unit, RosterError> {
        let readings = self.scenario.radar.readings(flight, condition, self.seed);
        let mut all = Vec::new();
        for tuned_on in &self.tuned_on {
            let roster = self.roster(kit, *tuned_on, &self.methods)?;
            let tracks = roster.tracks_ahead(flight, &readings, condition, self.seed);
            for (method, steps, forecasts) in tracks {
                all.push(MethodSteps {
                    forecasts,
                    method,
                    tuned_on: method.is_tuned().then_some(*tuned_on),
                    steps: steps.iter().map(StepRecord::from).collect(),
                });
            }
        }
        let floor_m = |(on, tunings): &(TunedOn, Tunings)| {
            (*on, tunings.floor_m(flight, &readings, condition))
        };
        Ok(Unit {
            tracks: all,
            floors_m: kit.tunings.iter().map(floor_m).collect(),
        })
    }

    /// The finished units of one condition, in the flights' order: tracks and bounds.
    fn finished(
        &self,
        work: &WorkFolder,
        condition: usize,
    ) -> Result<(Vec<FlightTracks<'_>>, Vec<Floors>), WorkFolderError> {
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
            floors.push(unit.floors_m);
        }
        Ok((tracks, floors))
    }
}

fn unit_name(condition: usize, flight: usize) -> String {
    format!("unit-{condition:03}-{flight:06}")
}
