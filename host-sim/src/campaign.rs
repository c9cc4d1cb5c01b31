//! The full evaluation: cross-validated, resumable, and the same bytes however often it was killed.

mod block;
pub mod cell_summary;
mod claim;
pub mod comparison;
mod example_runs;
pub mod fold_kit;
pub mod forecast_summary;
pub mod generalisation;
pub mod outcome;
pub mod shard;
pub mod step_record;
pub mod steps_parquet;
pub mod tuning_choice;
mod unit;
pub mod variation;
pub mod work_folder;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::GeneratorError;
use bnkf_model_export::radar::noise::NoiseTable;
use parquet::errors::ParquetError;
use rayon::prelude::*;

use crate::contest::fold::Folds;
use crate::contest::model::Model;
use crate::contest::own_filter::OwnFilter;
use crate::contest::roster::{Roster, RosterError, Supplies};
use crate::contest::runs::Runs;
use crate::contest::tuned_on::TunedOn;
use crate::method::Method;
use crate::scenario::Scenario;
use fold_kit::{FoldKit, FoldKitError, Part, Task};
use shard::Shard;
use steps_parquet::Detail;
use variation::Variation;
use work_folder::{WorkFolder, WorkFolderError};

/// What is evaluated, and how.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Radar and flights.
    pub scenario: Scenario,
    /// Flights, cut and placed, run after run.
    pub runs: Runs,
    /// Whether they were moved to random places, so that where they are says nothing.
    pub placed: bool,
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
    /// What is kept and written of every step.
    pub detail: Detail,
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
    #[error("flights of the variation \"{variation}\": {cause}")]
    Generator {
        /// Its name.
        variation: &'static str,
        /// Why not.
        cause: GeneratorError,
    },
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
    /// Finds out before the work, not after it, what the other worlds cannot have: flights that fit into the volume.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn check_worlds(&self) -> Result<(), CampaignError> {
        for variation in &Variation::ALL {
            self.varied_flights(variation, 1)?;
        }
        Ok(())
    }

    /// Makes those pieces of `shard` that `work` lacks, and what they need.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn make(
        &self,
        work: &WorkFolder,
        shard: Shard,
        watcher: Watcher<'_>,
    ) -> Result<(), CampaignError> {
        self.make_parts(work, shard, watcher)?;
        let kits = self.kits(work)?;
        self.make_units(&kits, work, shard, watcher)?;
        self.generalise(&kits[0][0], work, shard, watcher)
    }

    /// Whether all pieces are there that [`Campaign::sum_up`] needs.
    ///
    /// # Errors
    /// The names of those that are not.
    pub fn check(&self, work: &WorkFolder) -> Result<(), WorkFolderError> {
        let training = self.training();
        let parts = self.parts(&training).into_iter();
        let parts = parts.map(|(task, part)| part.name(task.fold, task.table));
        let flights = self.runs.flights.len();
        let units = (0..self.scenario.radar.conditions().len())
            .flat_map(|condition| (0..flights).map(move |flight| unit::name(condition, flight)));
        let all = parts.chain(units).chain(self.varied_names());
        let names: Vec<String> = all.filter(|name| !work.has(name)).collect();
        if names.is_empty() {
            Ok(())
        } else {
            Err(work.missing(names))
        }
    }

    /// The flights that each fold's models may learn from.
    fn training(&self) -> Vec<Vec<&Flight>> {
        (0..self.folds.count)
            .map(|fold| self.folds.training(self.runs.first(), fold))
            .collect()
    }

    fn task<'a>(
        &'a self,
        table: NoiseTable,
        fold: usize,
        training: &'a [Vec<&'a Flight>],
    ) -> Task<'a> {
        Task {
            fold,
            table,
            flights: &training[fold],
            placed: self.placed,
            generated: &self.to_tune_on,
            recursive: self.shipped.last(),
            radar: &self.scenario.radar,
            epochs: self.epochs,
            seed: self.seed,
        }
    }

    /// Every part of every fold's supplies, once.
    fn parts<'a>(&'a self, training: &'a [Vec<&'a Flight>]) -> Vec<(Task<'a>, Part)> {
        let needed = Part::needed(&self.methods, &self.tuned_on);
        let mut parts = Vec::new();
        for table in &self.scenario.radar.tables {
            for fold in 0..self.folds.count {
                let own = needed.iter();
                let own = own.filter(|part| part.is_of_a_fold() || fold == 0);
                parts.extend(own.map(|part| (self.task(*table, fold, training), *part)));
            }
        }
        parts
    }

    /// Makes the parts that `work` lacks: those of `shard` first, then those that no other process makes, and waits
    /// for the rest. Every unit needs its fold's.
    fn make_parts(
        &self,
        work: &WorkFolder,
        shard: Shard,
        watcher: Watcher<'_>,
    ) -> Result<(), CampaignError> {
        let training = self.training();
        let all = self.parts(&training);
        watcher(Progress::Stage("Tuning and training", all.len()));
        // Those that another process makes.
        let make = |parts: &[&(Task<'_>, Part)]| -> Result<Vec<usize>, CampaignError> {
            let one = |(index, (task, part)): (usize, &&(Task<'_>, Part))| {
                let name = part.name(task.fold, task.table);
                let Some(_claim) = work.claim(&name)? else {
                    return Ok(Some(index));
                };
                let told = std::cell::Cell::new(0);
                let done = |share: f64| {
                    let thousandths = (share * 1000.0) as u64;
                    watcher(Progress::Advance(thousandths - told.get()));
                    told.set(thousandths);
                };
                task.make(*part, work, &done)
                    .map_err(|cause| failed(task, cause))?;
                Ok(None)
            };
            let busy = parts.par_iter().enumerate().map(one);
            let busy = busy.collect::<Result<Vec<_>, CampaignError>>()?;
            Ok(busy.into_iter().flatten().collect())
        };
        let (own, others): (Vec<_>, Vec<_>) = all
            .iter()
            .enumerate()
            .partition(|(index, _)| shard.holds(*index));
        let mut left: Vec<&(Task<'_>, Part)> = Vec::new();
        for parts in [own, others] {
            let parts: Vec<_> = parts.into_iter().map(|(_, part)| part).collect();
            left.extend(make(&parts)?.into_iter().map(|busy| parts[busy]));
        }
        while let Some((task, part)) = left.first() {
            // Not on the pool's threads, which may be in the middle of a part that others wait for.
            work.wait(&part.name(task.fold, task.table))?;
            left = make(&left)?.into_iter().map(|busy| left[busy]).collect();
        }
        Ok(())
    }

    /// Supplies of every (table, fold), in the order of the scenario's tables.
    fn kits(&self, work: &WorkFolder) -> Result<Vec<Vec<FoldKit>>, CampaignError> {
        let training = self.training();
        let needed = Part::needed(&self.methods, &self.tuned_on);
        let kit = |table: &NoiseTable| {
            let kits = (0..self.folds.count).map(|fold| {
                let task = self.task(*table, fold, &training);
                let mut kit = task
                    .kit(&needed, work)
                    .map_err(|cause| failed(&task, cause))?;
                kit.models.extend(self.shipped.iter().cloned());
                Ok(kit)
            });
            kits.collect::<Result<Vec<_>, _>>()
        };
        self.scenario.radar.tables.iter().map(kit).collect()
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
}

fn failed(task: &Task<'_>, cause: FoldKitError) -> CampaignError {
    CampaignError::Kit {
        fold: task.fold,
        table: task.table,
        cause,
    }
}
