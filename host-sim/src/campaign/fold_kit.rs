//! What a fold's methods are made from: tuned parameters and trained blobs, fitted to the flights
//! that the fold does not test.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorError, generate};
use bnkf_model_export::flights::held_out::HeldOutError;
use bnkf_model_export::kernel::Tier;
use bnkf_model_export::memoryless::model::MemorylessModel;
use bnkf_model_export::memoryless::training::{Control, DivergedError, Event, State, Training};
use bnkf_model_export::memoryless::training_data::TrainingData;
use bnkf_model_export::memoryless::training_settings::{TrainingSettings, TrainingSettingsError};
use bnkf_model_export::radar::noise::NoiseTable;
use bnkf_model_export::recursive;
use bnkf_model_export::recursive::recipe::Recipe;
use bnkf_model_export::recursive::training::TrainingError;
use bnkf_model_export::recursive::tunable::Tunable;
use bnkf_model_export::recursive::tuning::{Tuning, usable};
use bnkf_model_export::seed;

use super::work_folder::{WorkFolder, WorkFolderError};
use crate::baseline::tuning::{FLIGHTS_MAX, spread};
use crate::contest::model::{Model, ModelError, ToTuneError};
use crate::contest::tuned_on::TunedOn;
use crate::contest::tunings::{Tunings, TuningsError};
use crate::method::Method;
use crate::scenario::radar::Radar;

/// Seed of the flights that are generated to tune on, and of their readings. Whatever is evaluated,
/// and however many flights, filters that are tuned on generated flights are the same.
pub const TUNING_SEED: u64 = 20_260_517;

/// Tuning takes so many episodes for every epoch of a network's training, up to its own number.
const EPISODES_PER_EPOCH: u64 = 5;

/// Generated flights that stand beside fewer recorded ones in [`TunedOn::Both`].
const GENERATED_IN_BOTH: usize = 60;

/// A fold's supplies for one noise table.
#[derive(Clone, Debug)]
pub struct FoldKit {
    /// Parameters of the tuned baselines, one set for each of the campaign's [`TunedOn`]; none if no
    /// method needs them.
    pub tunings: Vec<(TunedOn, Tunings)>,
    /// The blobs that methods need.
    pub models: Vec<Model>,
    /// The shipped recursive model, tuned on the fold's flights.
    pub tuned: Option<Model>,
}

/// One part of a kit, made by itself and kept by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Parameters of the tuned baselines. Those of generated flights are the same in every fold.
    Tunings(TunedOn),
    /// The blob of BNN and BNKF.
    Joint,
    /// The blob of BNKFe.
    PerAxis,
    /// The shipped recursive blob, tuned.
    Recursive,
}

/// Why a part cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum FoldKitError {
    /// The baselines cannot be tuned.
    #[error(transparent)]
    Tunings(#[from] TuningsError),
    /// Too few flights to train on.
    #[error("training: {0}")]
    HeldOut(#[from] HeldOutError),
    /// The training settings make no sense.
    #[error("training: {0}")]
    Settings(#[from] TrainingSettingsError),
    /// The loss is not a number.
    #[error("training: {0}")]
    Diverged(#[from] DivergedError),
    /// The weights fit into no blob.
    #[error("training: {0}")]
    Blob(#[from] bnkf::blob::BlobError),
    /// A kept blob is damaged.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The shipped recursive model cannot be tuned.
    #[error("tuning: {0}")]
    Untunable(#[from] ToTuneError),
    /// There is no recursive model to tune.
    #[error("tuning: no recursive model")]
    NoRecursive,
    /// The flights cannot be tuned on.
    #[error("tuning: {0}")]
    Tuning(#[from] TrainingError),
    /// Flights to rehearse cannot be generated.
    #[error("tuning: {0}")]
    Generator(#[from] GeneratorError),
    /// A part cannot be kept.
    #[error(transparent)]
    Work(#[from] WorkFolderError),
}

/// One fold's task.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// The fold.
    pub fold: usize,
    /// The noise table.
    pub table: NoiseTable,
    /// The flights that the fold does not test.
    pub flights: &'a [&'a Flight],
    /// Whether they were moved to random places.
    pub placed: bool,
    /// Generated flights to tune on.
    pub generated: &'a [Flight],
    /// The recursive model that runs, to be tuned.
    pub recursive: Option<&'a Model>,
    /// The radar that sees them.
    pub radar: &'a Radar,
    /// Training epochs.
    pub epochs: u32,
    /// Seed of everything random.
    pub seed: u64,
}

impl Part {
    /// The parts that `methods` need.
    pub fn needed(methods: &[Method], tuned_on: &[TunedOn]) -> Vec<Self> {
        let part = |method: &Method| match method {
            Method::Bnn | Method::Bnkf | Method::BnkfMoments => Some(Self::Joint),
            Method::Bnkfe | Method::BnkfeMoments => Some(Self::PerAxis),
            Method::RecursiveTuned => Some(Self::Recursive),
            _ => None,
        };
        let mut parts: Vec<Self> = Vec::new();
        for part in methods.iter().filter_map(part) {
            if !parts.contains(&part) {
                parts.push(part);
            }
        }
        if methods.iter().any(|method| method.is_tuned()) {
            parts.extend(tuned_on.iter().map(|on| Self::Tunings(*on)));
        }
        parts
    }

    /// Whether every fold has its own.
    pub fn is_of_a_fold(self) -> bool {
        self != Self::Tunings(TunedOn::Generated)
    }

    /// The name of the piece that it is kept as.
    pub fn name(self, fold: usize, table: NoiseTable) -> String {
        match self {
            Self::Tunings(TunedOn::Generated) => format!("{table}-generated.tunings"),
            Self::Tunings(on) => format!("fold-{fold}-{table}-{on}.tunings"),
            Self::Joint => format!("fold-{fold}-{table}-bnkf.bnkf"),
            Self::PerAxis => format!("fold-{fold}-{table}-bnkfe.bnkf"),
            Self::Recursive => format!("fold-{fold}-{table}-recursive.bnkf"),
        }
    }
}

impl Task<'_> {
    /// Makes `part` unless it is there. Calls `done` with growing parts of 1 on the way.
    ///
    /// # Errors
    /// See [`FoldKitError`].
    pub fn make(
        &self,
        part: Part,
        work: &WorkFolder,
        done: &dyn Fn(f64),
    ) -> Result<(), FoldKitError> {
        let name = part.name(self.fold, self.table);
        if !work.has(&name) {
            match part {
                Part::Tunings(on) => {
                    let flights = self.flights_of(on);
                    let seed = match on {
                        TunedOn::Generated => TUNING_SEED,
                        TunedOn::Recordings | TunedOn::Both => self.seed,
                    };
                    let tunings = Tunings::fit(&flights, self.radar, &[self.table], seed)?;
                    work.store(&name, &tunings)?;
                }
                Part::Joint => work.keep(&name, &self.train(false, done)?)?,
                Part::PerAxis => work.keep(&name, &self.train(true, done)?)?,
                Part::Recursive => work.keep(&name, &self.tune(done)?)?,
            }
        }
        done(1.0);
        Ok(())
    }

    /// What `parts` were made into.
    ///
    /// # Errors
    /// A part is damaged.
    pub fn kit(&self, parts: &[Part], work: &WorkFolder) -> Result<FoldKit, FoldKitError> {
        let mut kit = FoldKit {
            tunings: Vec::new(),
            models: Vec::new(),
            tuned: None,
        };
        for part in parts {
            let name = part.name(self.fold, self.table);
            match part {
                Part::Tunings(on) => kit
                    .tunings
                    .extend(work.load(&name)?.map(|tunings| (*on, tunings))),
                Part::Joint | Part::PerAxis => kit.models.push(Model::read(&work.path_of(&name))?),
                Part::Recursive => kit.tuned = Some(Model::read(&work.path_of(&name))?),
            }
        }
        Ok(kit)
    }

    fn flights_of(&self, on: TunedOn) -> Vec<&Flight> {
        let generated: Vec<&Flight> = self.generated.iter().collect();
        match on {
            TunedOn::Generated => generated,
            TunedOn::Recordings => self.flights.to_vec(),
            TunedOn::Both => {
                let count = self.flights.len().clamp(GENERATED_IN_BOTH, FLIGHTS_MAX / 2);
                spread(&generated, count)
                    .chain(spread(self.flights, FLIGHTS_MAX / 2))
                    .collect()
            }
        }
    }

    /// The recursive model after tuning on the fold's flights: near where they are, or anywhere in the volume as
    /// `model-export tune --place` if they were placed there.
    fn tune(&self, done: &dyn Fn(f64)) -> Result<Vec<u8>, FoldKitError> {
        let shipped = self.recursive.ok_or(FoldKitError::NoRecursive)?;
        let Tunable {
            blob_sha256,
            model,
            scenario,
        } = shipped.to_tune()?;
        let own = usable(
            self.flights
                .iter()
                .map(|flight| (*flight).clone())
                .collect(),
        );
        let familiar = generate(&scenario.training_flights())?;
        let ids = [seed::name_id("tune"), self.fold as u64, self.table as u64];
        let tuning = Tuning::new(blob_sha256, &own, self.placed);
        let recipe = scenario.recipe().tuned(tuning);
        let recipe = Recipe {
            seed: seed::derive(self.seed, &ids),
            episodes: recipe
                .episodes
                .min(EPISODES_PER_EPOCH * u64::from(self.epochs))
                .max(1),
            sampling: model.sampling,
            ..recipe
        };
        let episodes = recipe.episodes;
        let mut training = recursive::training::Training::tune(recipe, &familiar, &own, &model)?;
        while training.episode < episodes {
            training.episode();
            done(training.episode as f64 / episodes as f64);
        }
        Ok(training.model().blob()?)
    }

    fn train(&self, ensemble: bool, done: &dyn Fn(f64)) -> Result<Vec<u8>, FoldKitError> {
        let ids = [seed::name_id("fold"), self.fold as u64, self.table as u64];
        let settings = TrainingSettings {
            ensemble,
            hidden: vec![if ensemble { 32 } else { 64 }; 5],
            noise_table: self.table,
            epochs: self.epochs,
            seed: seed::derive(self.seed, &ids),
            ..TrainingSettings::default()
        };
        let flights = self
            .flights
            .iter()
            .map(|flight| (*flight).clone())
            .collect();
        let data = TrainingData::new(flights, &settings)?;
        let mut training =
            Training::new(&settings, &data, Tier::detect(), State::start(&settings)?);
        training.run(|_, event| {
            if let Event::Epoch(report) = event {
                done(f64::from(report.epoch) / f64::from(settings.epochs + settings.grid_epochs));
            }
            Control::Continue
        })?;
        let best = training
            .state
            .members
            .iter()
            .filter_map(|member| member.best.as_ref());
        let model = MemorylessModel {
            layout: settings.features.layout(),
            normalisation: data.normalisation.clone(),
            speed_sigma_mps: data.speed_sigma_mps,
            acceleration_sigma_mps2: data.acceleration_sigma_mps2,
            networks: best.map(|best| best.weights.clone()).collect(),
        };
        Ok(model.blob()?)
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
    use bnkf_model_export::radar::noise::NoiseTable;

    use super::{FLIGHTS_MAX, FoldKitError, GENERATED_IN_BOTH, Part, Task};
    use crate::campaign::work_folder::{Role, WorkFolder};
    use crate::contest::default_models;
    use crate::contest::tuned_on::TunedOn;
    use crate::method::Method;
    use crate::scenario::radar::Radar;

    fn flights(count: usize, seed: u64) -> Vec<Flight> {
        let settings = GeneratorSettings {
            flights: count,
            seed,
            duration_s: 2.0,
            ..GeneratorSettings::default()
        };
        generate(&settings).unwrap()
    }

    /// The same filters in every fold, with every seed and beside whatever is evaluated.
    #[test]
    fn what_is_tuned_on_generated_flights_depends_on_nothing_else() {
        let generated = flights(2, 5);
        let radar = Radar::paper(NoiseTable::Radians);
        let made = |fold: usize, others: &[Flight], seed: u64, on: TunedOn| {
            let folder = tempfile::tempdir().unwrap();
            let work = WorkFolder::open(&folder.path().join("work"), "plan", Role::Alone).unwrap();
            let task = Task {
                fold,
                table: NoiseTable::Radians,
                flights: &others.iter().collect::<Vec<_>>(),
                placed: false,
                generated: &generated,
                recursive: None,
                radar: &radar,
                epochs: 1,
                seed,
            };
            let part = Part::Tunings(on);
            task.make(part, &work, &|_| {}).unwrap();
            work.bytes(&part.name(fold, NoiseTable::Radians)).unwrap()
        };
        let (some, others) = (flights(1, 6), flights(2, 7));
        let tuned = made(0, &some, 1, TunedOn::Generated);
        assert!(tuned.is_some());
        assert_eq!(tuned, made(3, &others, 2, TunedOn::Generated));
        assert_ne!(tuned, made(0, &some, 1, TunedOn::Recordings));
    }

    #[test]
    fn both_takes_all_of_the_few_and_not_all_of_the_many() {
        let (generated, others) = (flights(FLIGHTS_MAX, 5), flights(3, 6));
        let radar = Radar::paper(NoiseTable::Radians);
        let others: Vec<&Flight> = others.iter().collect();
        let task = Task {
            fold: 0,
            table: NoiseTable::Radians,
            flights: &others,
            placed: false,
            generated: &generated,
            recursive: None,
            radar: &radar,
            epochs: 1,
            seed: 1,
        };
        let both = task.flights_of(TunedOn::Both);
        assert_eq!(both.len(), GENERATED_IN_BOTH + 3);
        assert_eq!(both[GENERATED_IN_BOTH..], others);
        assert_eq!(task.flights_of(TunedOn::Generated).len(), FLIGHTS_MAX);
    }

    #[test]
    fn the_tuned_tracker_is_another_blob_of_the_same_kind() {
        let settings = GeneratorSettings {
            flights: 2,
            ..GeneratorSettings::default()
        };
        let own = generate(&settings).unwrap();
        let own: Vec<&Flight> = own.iter().collect();
        let radar = Radar::paper(NoiseTable::Radians);
        let shipped = default_models::load().unwrap().pop().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let work = WorkFolder::open(&folder.path().join("work"), "plan", Role::Alone).unwrap();
        let mut task = Task {
            fold: 0,
            table: NoiseTable::Radians,
            flights: &own,
            placed: false,
            generated: &[],
            recursive: Some(&shipped),
            radar: &radar,
            epochs: 1,
            seed: 1,
        };
        task.make(Part::Recursive, &work, &|_| {}).unwrap();
        let kit = task.kit(&[Part::Recursive], &work).unwrap();
        let tuned = kit.tuned.expect("made");
        assert_eq!(tuned.blob().kind(), shipped.blob().kind());
        assert_ne!(tuned.sha256(), shipped.sha256());
        // Where flights stay it learns their places, where they were placed it does not.
        (task.placed, task.fold) = (true, 1);
        task.make(Part::Recursive, &work, &|_| {}).unwrap();
        let anywhere = task.kit(&[Part::Recursive], &work).unwrap().tuned;
        assert_ne!(tuned.volume(), shipped.volume());
        assert_eq!(anywhere.expect("made").volume(), shipped.volume());
        task.recursive = None;
        task.fold = 2;
        let nothing = task.make(Part::Recursive, &work, &|_| {});
        assert!(matches!(nothing, Err(FoldKitError::NoRecursive)));
    }

    #[test]
    fn parts_are_those_that_methods_need() {
        let parts = |methods: &[Method]| Part::needed(methods, &TunedOn::ALL);
        assert_eq!(parts(&[Method::Ekf, Method::Recursive]), []);
        assert_eq!(parts(&[Method::Bnn, Method::Bnkf]), [Part::Joint]);
        let moments = [Method::BnkfMoments, Method::BnkfeMoments];
        assert_eq!(parts(&moments), [Part::Joint, Part::PerAxis]);
        assert_eq!(parts(&[Method::RecursiveTuned]), [Part::Recursive]);
        assert_eq!(parts(&[Method::Imm10]), TunedOn::ALL.map(Part::Tunings));
    }
}
