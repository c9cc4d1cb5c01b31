//! A training run on disk: everything that is needed to continue it to the same bits.

use crate::blob::sealed::{self, SealError};
use crate::memoryless::member::{AdamMoments, Best, Member};
use crate::memoryless::training::State;
use crate::memoryless::training_settings::{TrainingSettings, TrainingSettingsError};
use crate::posterior::gaussian_weights::GaussianWeights;
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"BNKFrun1";

/// Why a checkpoint cannot be continued.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckpointError {
    /// It is not a whole checkpoint.
    #[error("not a usable checkpoint: it {0}")]
    Seal(#[from] SealError),
    /// Another version wrote it.
    #[error("the checkpoint was written by another version")]
    OtherVersion,
    /// It belongs to a run with other settings.
    #[error("the checkpoint was made with {field} = {saved}, this run has {given}")]
    OtherSettings {
        /// The first setting that differs.
        field: String,
        /// Its value in the checkpoint.
        saved: String,
        /// Its value now.
        given: String,
    },
    /// It belongs to a run with other flights.
    #[error("the checkpoint was made from other flights (SHA-256 {saved}, now {given})")]
    OtherFlights {
        /// Fingerprint in the checkpoint.
        saved: String,
        /// Fingerprint now.
        given: String,
    },
    /// A number that no run writes.
    #[error("the checkpoint's `{0}` is impossible")]
    Impossible(&'static str),
    /// The settings of this run make no sense.
    #[error(transparent)]
    Settings(#[from] TrainingSettingsError),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    settings: serde_json::Value,
    flights_sha256: String,
    epoch: u32,
    grid_start: Option<u32>,
    chunk: u32,
    batch: u32,
    rows: u64,
    loss: f64,
    steps: u64,
    stale: u32,
    /// Per network: held-out loss and epoch of the best weights.
    best: Vec<Option<(f64, u32)>>,
    /// The same of the best weights before they were put on the grid.
    unrounded: Vec<Option<(f64, u32)>>,
}

/// The bytes of a checkpoint.
#[must_use]
pub fn to_bytes(settings: &TrainingSettings, flights_sha256: &str, state: &State) -> Vec<u8> {
    let brief = |best: &Option<Best>| best.as_ref().map(|best| (best.loss, best.epoch));
    let members = &state.members;
    let header = Header {
        settings: serde_json::json!(settings),
        flights_sha256: flights_sha256.to_owned(),
        epoch: state.epoch,
        grid_start: state.grid_start,
        chunk: state.chunk,
        batch: state.batch,
        rows: state.rows,
        loss: state.loss,
        steps: state.steps,
        stale: state.stale,
        best: members.iter().map(|member| brief(&member.best)).collect(),
        unrounded: members
            .iter()
            .map(|member| brief(&member.unrounded))
            .collect(),
    };
    let numbers = state.members.iter().flat_map(lists).flatten().copied();
    sealed::seal(MAGIC, &serde_json::json!(header).to_string(), numbers)
}

/// The lists of numbers of a member, in the order of the file.
fn lists(member: &Member) -> Vec<&Vec<f32>> {
    let (weights, moments) = (&member.weights, &member.moments);
    let mut lists = vec![
        &weights.means,
        &weights.log_sigmas,
        &moments.mean_first,
        &moments.mean_second,
        &moments.log_sigma_first,
        &moments.log_sigma_second,
    ];
    for best in [&member.best, &member.unrounded].into_iter().flatten() {
        lists.extend([&best.weights.means, &best.weights.log_sigmas]);
    }
    lists
}

/// The state in a checkpoint's `bytes`, which must belong to the given settings and flights.
///
/// # Errors
/// See [`CheckpointError`].
pub fn parse(
    bytes: &[u8],
    settings: &TrainingSettings,
    flights_sha256: &str,
) -> Result<State, CheckpointError> {
    use CheckpointError::OtherVersion;
    let (header, numbers) = sealed::open(MAGIC, bytes)?;
    let header: Header = serde_json::from_slice(header).map_err(|_| OtherVersion)?;
    compare(&header.settings, &serde_json::json!(settings))?;
    if header.flights_sha256 != flights_sha256 {
        return Err(CheckpointError::OtherFlights {
            saved: header.flights_sha256,
            given: flights_sha256.to_owned(),
        });
    }
    check_progress(&header, settings)?;
    let mut state = State::start(settings)?;
    let networks = state.members.len();
    if header.best.len() != networks || header.unrounded.len() != networks {
        return Err(OtherVersion);
    }
    let parameters = state.members[0].weights.architecture.parameters();
    let mut lists = numbers.chunks(parameters).map(<[f32]>::to_vec);
    let briefs = header.best.into_iter().zip(header.unrounded);
    for (member, (best, unrounded)) in state.members.iter_mut().zip(briefs) {
        let mut list = || {
            lists
                .next()
                .filter(|list| list.len() == parameters)
                .ok_or(OtherVersion)
        };
        let architecture = member.weights.architecture.clone();
        member.weights.means = list()?;
        member.weights.log_sigmas = list()?;
        member.moments = AdamMoments {
            mean_first: list()?,
            mean_second: list()?,
            log_sigma_first: list()?,
            log_sigma_second: list()?,
        };
        let mut read = |brief: Option<(f64, u32)>| -> Result<Option<Best>, CheckpointError> {
            let Some((loss, epoch)) = brief else {
                return Ok(None);
            };
            let architecture = architecture.clone();
            let weights = GaussianWeights {
                architecture,
                means: list()?,
                log_sigmas: list()?,
            };
            Ok(Some(Best {
                weights,
                loss,
                epoch,
            }))
        };
        member.best = read(best)?;
        member.unrounded = read(unrounded)?;
        member.restore_grid();
    }
    if lists.next().is_some() {
        return Err(OtherVersion);
    }
    let Header {
        epoch,
        grid_start,
        chunk,
        batch,
        rows,
        loss,
        steps,
        stale,
        ..
    } = header;
    Ok(State {
        epoch,
        grid_start,
        chunk,
        batch,
        rows,
        loss,
        steps,
        stale,
        members: state.members,
    })
}

/// Checks what the training counts with: the file's seal is no secret.
fn check_progress(header: &Header, settings: &TrainingSettings) -> Result<(), CheckpointError> {
    let epochs = u64::from(settings.epochs) + u64::from(settings.grid_epochs);
    let complete = |best: &[Option<(f64, u32)>]| best.iter().all(Option::is_some);
    let on_grid = header.grid_start.is_some();
    let fine = [
        ("epoch", u64::from(header.epoch) <= epochs),
        (
            "grid_start",
            header.grid_start.is_none_or(|start| start <= header.epoch),
        ),
        ("steps", header.steps < u64::MAX / 2),
        ("rows", header.rows < u64::MAX / 2),
        ("stale", header.stale <= header.epoch),
        ("loss", header.loss.is_finite()),
        ("unrounded", complete(&header.unrounded) || !on_grid),
        (
            "best",
            complete(&header.best) || on_grid || header.epoch == 0,
        ),
    ];
    match fine.iter().find(|(_, fine)| !fine) {
        None => Ok(()),
        Some((field, _)) => Err(CheckpointError::Impossible(field)),
    }
}

fn compare(saved: &serde_json::Value, given: &serde_json::Value) -> Result<(), CheckpointError> {
    let (Some(saved), Some(given)) = (saved.as_object(), given.as_object()) else {
        return Err(CheckpointError::OtherVersion);
    };
    if !saved.keys().eq(given.keys()) {
        return Err(CheckpointError::OtherVersion);
    }
    match given.iter().find(|(field, value)| saved[*field] != **value) {
        None => Ok(()),
        Some((field, value)) => Err(CheckpointError::OtherSettings {
            field: field.clone(),
            saved: saved[field].to_string(),
            given: value.to_string(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::{CheckpointError, parse, to_bytes};
    use crate::blob::sealed::SealError;
    use crate::flights::generator::{GeneratorSettings, generate};
    use crate::kernel::Tier;
    use crate::memoryless::training::{Control, End, Event, State, Training};
    use crate::memoryless::training_data::TrainingData;
    use crate::memoryless::training_settings::TrainingSettings;

    fn settings(ensemble: bool) -> TrainingSettings {
        TrainingSettings {
            ensemble,
            hidden: vec![8, 8],
            epochs: 2,
            grid_epochs: 2,
            batch: 64,
            ..TrainingSettings::default()
        }
    }

    fn data(settings: &TrainingSettings) -> TrainingData {
        data_of(4, settings)
    }

    fn data_of(flights: usize, settings: &TrainingSettings) -> TrainingData {
        let generator = GeneratorSettings {
            flights,
            duration_s: 3.0,
            ..GeneratorSettings::default()
        };
        TrainingData::new(generate(&generator).unwrap(), settings).unwrap()
    }

    #[test]
    fn interrupted_anywhere_and_continued_ends_with_the_same_bits() {
        for ensemble in [false, true] {
            let settings = settings(ensemble);
            let data = data(&settings);
            let tier = Tier::detect();
            let mut events = 0;
            let start = State::start(&settings).unwrap();
            let mut whole = Training::new(&settings, &data, tier, start.clone());
            let end = whole.run(|_, _| {
                events += 1;
                Control::Continue
            });
            assert_eq!(end, Ok(End::Complete));
            assert!(events > 20, "{events}");
            // Through a file after every seventh event, in mid-epoch and between epochs.
            let mut state = start;
            loop {
                let mut left = 7;
                let mut part = Training::new(&settings, &data, tier, state);
                let end = part.run(|_, _| {
                    left -= 1;
                    if left == 0 {
                        Control::Stop
                    } else {
                        Control::Continue
                    }
                });
                let bytes = to_bytes(&settings, &data.sha256, &part.state);
                state = parse(&bytes, &settings, &data.sha256).unwrap();
                assert_eq!(state, part.state);
                if end.unwrap() == End::Complete {
                    break;
                }
            }
            assert_eq!(state, whole.state);
        }
    }

    #[test]
    fn training_lowers_the_held_out_loss() {
        let settings = TrainingSettings {
            epochs: 10,
            grid_epochs: 0,
            rate: 0.02,
            ..settings(false)
        };
        let data = data_of(30, &settings);
        let start = State::start(&settings).unwrap();
        let mut losses = Vec::new();
        let mut training = Training::new(&settings, &data, Tier::detect(), start);
        let end = training.run(|_, event| {
            if let Event::Epoch(report) = event {
                losses.push(report.validation_loss);
            }
            Control::Continue
        });
        end.unwrap();
        assert!(losses[9] < 0.3 * losses[0], "{losses:?}");
        let best = training.state.members[0].best.as_ref().unwrap();
        assert_eq!(
            best.loss,
            losses.iter().copied().fold(f64::INFINITY, f64::min)
        );
    }

    #[test]
    fn other_runs_and_damage_are_refused_and_named() {
        let settings = settings(false);
        let state = State::start(&settings).unwrap();
        let bytes = to_bytes(&settings, "abc", &state);
        assert_eq!(parse(&bytes, &settings, "abc").unwrap(), state);

        let other = TrainingSettings {
            prior_sigma: 0.25,
            ..settings.clone()
        };
        let error = parse(&bytes, &other, "abc").unwrap_err().to_string();
        assert_eq!(
            error,
            "the checkpoint was made with prior_sigma = 0.3, this run has 0.25"
        );
        let error = parse(&bytes, &settings, "abd").unwrap_err();
        assert!(
            matches!(error, CheckpointError::OtherFlights { .. }),
            "{error}"
        );
        let error = parse(&bytes[..bytes.len() - 1], &settings, "abc").unwrap_err();
        assert_eq!(error, CheckpointError::Seal(SealError::Damaged));
    }

    #[test]
    fn a_loss_that_is_not_finite_is_an_error() {
        let settings = settings(false);
        let data = data(&settings);
        let mut start = State::start(&settings).unwrap();
        start.members[0].weights.means[3] = f32::NAN;
        let mut training = Training::new(&settings, &data, Tier::detect(), start);
        let error = training.run(|_, _| Control::Continue).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the loss is not finite in epoch 1: lower --rate"
        );
    }
}
