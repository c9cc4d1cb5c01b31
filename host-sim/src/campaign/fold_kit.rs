//! What a fold's methods are made from: tuned parameters and trained blobs, fitted to the flights
//! that the fold does not test.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::held_out::HeldOutError;
use bnkf_model_export::kernel::Tier;
use bnkf_model_export::memoryless::model::MemorylessModel;
use bnkf_model_export::memoryless::training::{Control, DivergedError, Event, State, Training};
use bnkf_model_export::memoryless::training_data::TrainingData;
use bnkf_model_export::memoryless::training_settings::{TrainingSettings, TrainingSettingsError};
use bnkf_model_export::radar::noise::NoiseTable;
use bnkf_model_export::seed;

use super::work_folder::{WorkFolder, WorkFolderError};
use crate::contest::model::{Model, ModelError};
use crate::contest::tunings::{Tunings, TuningsError};
use crate::method::Method;
use crate::scenario::radar::Radar;

/// A fold's supplies for one noise table.
#[derive(Clone, Debug)]
pub struct FoldKit {
    /// Parameters of the tuned baselines, if a method needs them.
    pub tunings: Option<Tunings>,
    /// The blobs that methods need.
    pub models: Vec<Model>,
}

/// One part of a kit, made by itself and kept by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The tuned baselines.
    Tunings,
    /// The blob of BNN and BNKF.
    Joint,
    /// The blob of BNKFe.
    PerAxis,
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
    /// Flights to fit to.
    pub flights: &'a [&'a Flight],
    /// The radar that sees them.
    pub radar: &'a Radar,
    /// Training epochs.
    pub epochs: u32,
    /// Seed of everything random.
    pub seed: u64,
}

impl Part {
    /// The parts that `methods` need.
    pub fn needed(methods: &[Method]) -> Vec<Self> {
        let part = |method: &Method| match method {
            Method::Ekf | Method::Ukf | Method::Recursive => None,
            Method::Bnn | Method::Bnkf => Some(Self::Joint),
            Method::Bnkfe => Some(Self::PerAxis),
            Method::EkfTuned
            | Method::UkfTuned
            | Method::CkfTuned
            | Method::Imm5
            | Method::Imm10
            | Method::Particle
            | Method::Converted
            | Method::PopulationMean
            | Method::ConstantRange
            | Method::Fused => Some(Self::Tunings),
        };
        let mut parts: Vec<Self> = Vec::new();
        for part in methods.iter().filter_map(part) {
            if !parts.contains(&part) {
                parts.push(part);
            }
        }
        parts
    }

    fn name(self, fold: usize, table: NoiseTable) -> String {
        match self {
            Self::Tunings => format!("fold-{fold}-{table}.tunings"),
            Self::Joint => format!("fold-{fold}-{table}-bnkf.bnkf"),
            Self::PerAxis => format!("fold-{fold}-{table}-bnkfe.bnkf"),
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
        if work.bytes(&name)?.is_none() {
            match part {
                Part::Tunings => {
                    let tunings = Tunings::fit(self.flights, self.radar, &[self.table], self.seed)?;
                    work.store(&name, &tunings)?;
                }
                Part::Joint => work.keep(&name, &self.train(false, done)?)?,
                Part::PerAxis => work.keep(&name, &self.train(true, done)?)?,
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
            tunings: None,
            models: Vec::new(),
        };
        for part in parts {
            let name = part.name(self.fold, self.table);
            match part {
                Part::Tunings => kit.tunings = work.load(&name)?,
                Part::Joint | Part::PerAxis => kit.models.push(Model::read(&work.path_of(&name))?),
            }
        }
        Ok(kit)
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
