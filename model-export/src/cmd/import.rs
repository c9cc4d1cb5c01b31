//! `model-export import`: a Bayesian network that PyTorch trained, as a blob.

use super::flight_source::{FlightSourceError, builtin};
use super::rounding::{BUILTIN_FLIGHTS, BUILTIN_SEED, Rounding, Way, layer_table};
use crate::atomic_file::{self, AtomicWriteError};
use crate::blob::unrounded;
use crate::flights::data_hash;
use crate::import::layers::{self, LayersError};
use crate::import::model;
use crate::import::recipe::{self, RecipeError};
use crate::import::weight_file::{self, WeightFileError};
use crate::radar::noise::NoiseTable;
use crate::regular_file::{self, ReadFileError};
use bnkf::blob::{Blob, BlobError, BlobField};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Reads a Bayesian network of torchbnn or bayesian-torch and writes the blob.
///
/// The weights come from a file of torch.save(model.state_dict()) or of safetensors; nothing in it is executed.
/// Activation, features, normalisation and population come from a TOML file. The unrounded weights are written
/// beside the blob, OUT.f32, so that `verify` can compare the two; how far rounding moves the estimates of
/// built-in flights is said at once.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The weights: a file of torch.save (.pt) or of safetensors
    #[arg(long, value_name = "FILE")]
    weights: PathBuf,
    /// What the weights do not say (TOML; see docs/import.md)
    #[arg(long, value_name = "FILE")]
    recipe: PathBuf,
    /// The blob to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// As `verify` does by default, with fewer passes.
const WAY: Way = Way {
    noise_table: NoiseTable::Radians,
    rows: 100,
    passes: 300,
    moments: false,
    seed: 1,
};

/// Why nothing was imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// The recipe.
    #[error("{}: {cause}", path.display())]
    Recipe {
        /// Its file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: RecipeError,
    },
    /// The file of weights.
    #[error("{}: {cause}", path.display())]
    Weights {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: WeightFileError,
    },
    /// Its tensors are no network.
    #[error("{}: {cause}", path.display())]
    Layers {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: LayersError,
    },
    /// No blob can hold the network.
    #[error("{}: no blob holds it: {cause}", path.display())]
    Blob {
        /// The recipe, where passes and population stand, or the file of weights.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: BlobError,
    },
    /// No flights.
    #[error(transparent)]
    Flights(#[from] FlightSourceError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`ImportError`].
pub fn run(args: &Args) -> Result<(), ImportError> {
    let sidecar = unrounded::path_beside(&args.out);
    let inputs = [args.weights.clone(), args.recipe.clone()];
    atomic_file::check(&[&args.out, &sidecar], &inputs)?;
    let at = |path: &Path| path.to_owned();
    let text = regular_file::read_text(&args.recipe, recipe::BYTES_MAX)?;
    let recipe = recipe::parse(&text).map_err(|cause| ImportError::Recipe {
        path: at(&args.recipe),
        cause,
    })?;
    let bytes = regular_file::read(&args.weights, weight_file::BYTES_MAX)?;
    let file = weight_file::parse(&bytes).map_err(|cause| ImportError::Weights {
        path: at(&args.weights),
        cause,
    })?;
    let (names, inputs) = (recipe.layers.as_deref(), recipe.features.len());
    let networks = layers::networks(&file, recipe.convention, names, inputs);
    let networks = networks.map_err(|cause| ImportError::Layers {
        path: at(&args.weights),
        cause,
    })?;
    let of_blob = |cause| {
        use BlobField::{BiasMean, BiasVariance, ChannelScale, VarianceMax};
        let of_weights =
            [VarianceMax, ChannelScale, BiasMean, BiasVariance].map(BlobError::Invalid);
        let file = if of_weights.contains(&cause) {
            &args.weights
        } else {
            &args.recipe
        };
        ImportError::Blob {
            path: at(file),
            cause,
        }
    };
    let bytes = model::blob(&recipe, &networks).map_err(of_blob)?;
    let blob = Blob::parse(&bytes).map_err(of_blob)?;
    let rounding = Rounding::of(
        &blob,
        &networks,
        &builtin(BUILTIN_FLIGHTS, BUILTIN_SEED)?,
        &WAY,
    );
    atomic_file::write(&sidecar, &unrounded::to_bytes(&bytes, &networks))?;
    // The blob last: a new one is never without the file beside it.
    atomic_file::write(&args.out, &bytes)?;
    let mut text = format!(
        "{}: {} bytes, SHA-256 {}\n",
        args.out.display(),
        bytes.len(),
        data_hash::of_bytes(&bytes)
    );
    text += &layer_table(&networks);
    text += &rounding.table;
    std::io::stdout().write_all(text.as_bytes())?;
    if !rounding.is_accepted {
        eprintln!("warning: rounding moves the estimates further than `verify` accepts");
    }
    Ok(())
}
