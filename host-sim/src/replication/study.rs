//! Trains and scores every line of the tables on one split of the flights.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::posterior::architecture::ArchitectureError;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::seed;

use super::departure::Departure;
use super::entry::{Entry, Estimator};
use super::learner::DivergedError;
use super::network_run::NetworkRun;
use super::observation::observe;
use super::recipe::Recipe;
use super::summary::{Summary, Tally};
use crate::baseline::correction::Correction;
use crate::baseline::kalman::{Kalman, PAPER_Q_M2_S3};
use crate::baseline::memoryless::{Memoryless, Rule};
use crate::baseline::motion::WhiteAcceleration;
use crate::baseline::origin::Origin;
use crate::baseline::prior::{PopulationPrior, PriorError};
use crate::baseline::sigma_points::Spread;
use crate::contest::fold::{FoldError, Folds};
use crate::contest::track::track;
use crate::filter::Filter;

/// Folds that the flights are dealt into; the first is tested, the others train.
pub const FOLDS: usize = 5;

/// Flights and how the networks are trained and asked.
#[derive(Clone, Debug)]
pub struct Study {
    /// All flights, in the radar's frame.
    pub flights: Vec<Flight>,
    /// Training epochs of every network.
    pub epochs: u32,
    /// Monte Carlo passes, at least 2.
    pub passes: usize,
    /// Seed of everything random.
    pub seed: u64,
}

/// Why a study has no result.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The flights cannot be divided.
    #[error(transparent)]
    Folds(#[from] FoldError),
    /// The training flights have no population.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// The training flights give no pair of readings.
    #[error("the training flights give no pair of readings")]
    NoPairs,
    /// A network has an impossible shape.
    #[error(transparent)]
    Architecture(#[from] ArchitectureError),
    /// A training diverged.
    #[error(transparent)]
    Diverged(#[from] DivergedError),
    /// No thread could be started.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Work on one thread: the lines that share their networks, or a line that has none.
struct Task {
    level: usize,
    /// Indices of the entries.
    entries: Vec<usize>,
}

/// The flights of one split.
pub(super) struct Split<'a> {
    pub training: Vec<&'a Flight>,
    pub tested: Vec<&'a Flight>,
}

impl Study {
    /// Training and test flights of a recipe.
    ///
    /// # Errors
    /// There are fewer recordings (or segments) than folds.
    pub(super) fn split(&self, recipe: &Recipe) -> Result<Split<'_>, FoldError> {
        let folds = if recipe.departs(Departure::SegmentFolds) {
            let own = |flight: &Flight| Flight {
                source: flight.name.clone(),
                ..flight.clone()
            };
            let alone: Vec<Flight> = self.flights.iter().map(own).collect();
            Folds::new(&alone, FOLDS, self.seed)?
        } else {
            Folds::new(&self.flights, FOLDS, self.seed)?
        };
        let tested = self.flights.iter().zip(&folds.of_flight);
        Ok(Split {
            training: folds.training(&self.flights, 0),
            tested: tested.filter(|(_, of)| **of == 0).map(|(f, _)| f).collect(),
        })
    }

    /// Units that [`Study::run`] reports for `entries`.
    pub fn units(&self, entries: &[Entry]) -> u64 {
        let tasks = tasks(entries);
        let unit = |task: &Task| self.units_of(&entries[task.entries[0]]);
        tasks.iter().map(unit).sum()
    }

    fn units_of(&self, entry: &Entry) -> u64 {
        match entry.estimator.per_output() {
            None => 1,
            Some(per_output) => NetworkRun::units(&entry.recipe, per_output, self.epochs),
        }
    }

    /// The cells of every entry at low, medium and high noise, all sampling rates together.
    /// `advance` is told how many units of work are done. The result does not depend on the number
    /// of threads.
    ///
    /// # Errors
    /// See [`StudyError`].
    pub fn run(
        &self,
        entries: &[Entry],
        advance: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<[Summary; 3]>, StudyError> {
        let mut tasks = tasks(entries);
        // Long ones first, so that no thread ends up with a long one alone.
        tasks.sort_by_key(|task| std::cmp::Reverse(self.units_of(&entries[task.entries[0]])));
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let next = AtomicUsize::new(0);
        let done: Mutex<Vec<(usize, usize, Summary)>> = Mutex::new(Vec::new());
        let worker = || -> Result<(), StudyError> {
            // A pool of one: split further, a task would wait in the middle of a step for another.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                let tallies = pool.install(|| self.work(entries, task, advance));
                let tallies = match tallies {
                    Ok(tallies) => tallies,
                    Err(error) => {
                        // The others have nothing left to do.
                        next.store(tasks.len(), Ordering::Relaxed);
                        return Err(error);
                    }
                };
                let cells = task.entries.iter().zip(tallies);
                let cells = cells.map(|(entry, tally)| (*entry, task.level, tally.summary()));
                lock(&done).extend(cells);
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
            workers
                .into_iter()
                .try_for_each(|worker| match worker.join() {
                    Ok(result) => result,
                    Err(panic) => std::panic::resume_unwind(panic),
                })
        })?;
        let mut lines = vec![[Tally::default().summary(); 3]; entries.len()];
        for (entry, level, summary) in lock(&done).drain(..) {
            lines[entry][level] = summary;
        }
        Ok(lines)
    }

    fn work(
        &self,
        entries: &[Entry],
        task: &Task,
        advance: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Tally>, StudyError> {
        let members: Vec<&Entry> = task.entries.iter().map(|&index| &entries[index]).collect();
        let level = NoiseLevel::ALL[task.level];
        let Some(per_output) = members[0].estimator.per_output() else {
            let tally = self.baseline(members[0], level)?;
            advance(1);
            return Ok(vec![tally]);
        };
        let run = NetworkRun {
            study: self,
            recipe: members[0].recipe.training_part(),
            per_output,
            level,
        };
        let users: Vec<(Estimator, Recipe)> = members
            .iter()
            .map(|entry| (entry.estimator, entry.recipe))
            .collect();
        run.tallies(&users, advance)
    }

    /// Seed of the readings and the weights of noise level `level`: the same for every recipe, so
    /// that recipes differ by what they are and not by their luck.
    pub(super) fn level_seed(&self, level: NoiseLevel) -> u64 {
        seed::derive(self.seed, &[seed::name_id("replica"), level as u64])
    }

    /// An estimator that is not trained.
    fn baseline(&self, entry: &Entry, level: NoiseLevel) -> Result<Tally, StudyError> {
        let (recipe, split) = (&entry.recipe, self.split(&entry.recipe)?);
        let prior = PopulationPrior::fit(split.training.iter().copied())?;
        let mut tally = Tally::default();
        for flight in &split.tested {
            for rate in SamplingRate::ALL {
                let readings = observe(flight, recipe, level, rate, self.level_seed(level));
                let mut filter = baseline_filter(entry.estimator, prior);
                for step in track(filter.as_mut(), flight, &readings) {
                    if step.in_gap && recipe.departs(Departure::GapsUnscored) {
                        continue;
                    }
                    // Not a number is no outlier, but their filter lets it through as little.
                    let lost = step.scored.diverged && recipe.departs(Departure::OutliersDropped);
                    tally.add((!lost).then_some(step.scored.score), recipe);
                }
            }
        }
        Ok(tally)
    }
}

fn baseline_filter(estimator: Estimator, prior: PopulationPrior) -> Box<dyn Filter> {
    match estimator {
        Estimator::Ekf => Box::new(Kalman::paper_ekf()),
        Estimator::Ukf => Box::new(Kalman::paper_ukf()),
        Estimator::UkfNarrow => {
            let motion = WhiteAcceleration {
                q_m2_s3: PAPER_Q_M2_S3,
            };
            let spread = Spread {
                alpha: 1e-3,
                ..Spread::UNIT
            };
            let correction = Correction::SigmaPoints(spread);
            Box::new(Kalman::new(motion, correction, Origin::Truth))
        }
        Estimator::Converted => Box::new(Memoryless::new(Rule::Converted, prior)),
        Estimator::ConstantRange | Estimator::Bnn | Estimator::Bnkf | Estimator::Bnkfe => {
            Box::new(Memoryless::new(Rule::ConstantRange, prior))
        }
    }
}

/// Entries that share their networks work together.
fn tasks(entries: &[Entry]) -> Vec<Task> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let network = |entry: &Entry| {
            let per_output = entry.estimator.per_output()?;
            Some((entry.recipe.training_part(), per_output))
        };
        let own = network(entry);
        let group = groups
            .iter_mut()
            .find(|group| own.is_some() && network(&entries[group[0]]) == own);
        match group {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    let at = |level: usize| {
        groups.iter().map(move |group| Task {
            level,
            entries: group.clone(),
        })
    };
    (0..NoiseLevel::ALL.len()).flat_map(at).collect()
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    // A panic elsewhere ends the run; what is in the list is whole.
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}
