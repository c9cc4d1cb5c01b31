//! `model-export moments`: how right the moments without passes are.

use super::blob_file::{self, BlobFileError};
use crate::atomic_file::{self, AtomicWriteError};
use crate::flights::generator::{GeneratorError, generate};
use crate::moments::comparison::{
    COVARIANCE_MEDIAN_MAX, COVARIANCE_P95_MAX, Errors, MEAN_MEDIAN_MAX, References, references,
};
use crate::moments::inputs::levels;
use crate::posterior::architecture::ArchitectureError;
use crate::recursive::scenario::Scenario;
use crate::regular_file::{self, ReadFileError};
use bnkf::blob::{Activation, Blob, NetworkView};
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Longest file of references, bytes: a thousand inputs of a recursive network.
const REFERENCES_BYTES_MAX: u64 = 1 << 24;

/// Compares the firmware's moments without passes with those of very many passes.
///
/// Prints how far covariance and mean of every network are from what passes of the same weights
/// say, noise by noise. Fails if a median or a 95th percentile is beyond its limit.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The blob
    model: PathBuf,
    /// Noises, rates and held-out flights of a recursive blob; noises of a memoryless one are the paper's
    #[arg(long, value_enum, default_value_t = Scenario::Paper)]
    scenario: Scenario,
    /// Inputs for each noise
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..))]
    inputs: u16,
    /// Passes for each input
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(2..=100_000_000))]
    passes: u32,
    /// Seed of radar noise and passes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Writes inputs and what the passes say to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Reads them from such a file instead of running any passes
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scenario", "inputs", "passes", "seed", "json"])]
    references: Option<PathBuf>,
}

/// Why nothing was compared, or what was found.
#[derive(Debug, thiserror::Error)]
pub enum MomentsError {
    /// The file is not a usable blob.
    #[error(transparent)]
    File(#[from] BlobFileError),
    /// Flights cannot be generated.
    #[error(transparent)]
    Generator(#[from] GeneratorError),
    /// The blob holds no network.
    #[error(transparent)]
    Architecture(#[from] ArchitectureError),
    /// The passes that the moments are compared with know GELU only.
    #[error("{}: its hidden layers do not end in GELU, and the fast passes know nothing else", .0.display())]
    Activation(PathBuf),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// The references cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// They are none.
    #[error("{}: not references of this version: {cause}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: serde_json::Error,
    },
    /// They belong to another blob.
    #[error("{}: belongs to the blob {found:08x}, not {blob:08x}", path.display())]
    OtherBlob {
        /// The file.
        path: PathBuf,
        /// Checksum in the file.
        found: u32,
        /// Checksum of the blob.
        blob: u32,
    },
    /// They are of other networks, or none.
    #[error("{}: the references are not of its networks", .0.display())]
    Shape(PathBuf),
    /// The moments are too far from those of the passes.
    #[error("{}: the moments are further than {:.0} % (median) or {:.0} % (95th percentile) of the covariance, or {MEAN_MEDIAN_MAX} sigma of the mean (median), from those of the passes", .0.display(), 100.0 * COVARIANCE_MEDIAN_MAX, 100.0 * COVARIANCE_P95_MAX)]
    Rejected(PathBuf),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// What `--json` writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct File {
    /// Checksum of the blob.
    pub blob_crc: u32,
    /// Networks, level by level.
    pub references: Vec<References>,
}

/// Runs the command.
///
/// # Errors
/// See [`MomentsError`].
///
/// # Panics
/// Never: every field has a representation in JSON.
pub fn run(args: &Args) -> Result<(), MomentsError> {
    let bytes = blob_file::read(&args.model)?;
    let blob = Blob::parse(&bytes).map_err(|cause| BlobFileError::Blob {
        path: args.model.clone(),
        cause,
    })?;
    let is_gelu = |network: NetworkView<'_>| network.activation() == Activation::Gelu;
    if !blob.networks().all(is_gelu) {
        return Err(MomentsError::Activation(args.model.clone()));
    }
    if let Some(path) = &args.json {
        let (outputs, inputs) = (
            std::slice::from_ref(path),
            std::slice::from_ref(&args.model),
        );
        atomic_file::check(outputs, inputs)?;
    }
    let found = match &args.references {
        Some(path) => read(path, &blob)?,
        None => {
            let flights = generate(&args.scenario.held_out_flights())?;
            let count = usize::from(args.inputs);
            let levels = levels(&blob, args.scenario, &flights, count, args.seed);
            references(&blob, &levels, args.passes, args.seed)?
        }
    };
    let mut text = format!(
        "{:<8}{:<14}{:>7}{:>26}{:>28}\n",
        "network", "noise", "inputs", "covariance med/p95/max", "mean, sigma: med/p95/max"
    );
    let mut accepted = true;
    for references in &found {
        let errors = Errors::of(&blob, references);
        let errors = errors.ok_or_else(|| MomentsError::Shape(args.model.clone()))?;
        accepted &= errors.accepted();
        let [c, m] = [errors.covariance, errors.mean];
        text += &format!(
            "{:<8}{:<14}{:>7}{:>26}{:>28}\n",
            references.network,
            references.level,
            errors.count,
            format!("{:.4} {:.4} {:.4}", c[0], c[1], c[2]),
            format!("{:.4} {:.4} {:.4}", m[0], m[1], m[2]),
        );
    }
    std::io::stdout().write_all(text.as_bytes())?;
    if let Some(path) = &args.json {
        let file = File {
            blob_crc: blob.checksum(),
            references: found,
        };
        let text = serde_json::to_string(&file).expect("every field has a representation");
        atomic_file::write(path, text.as_bytes())?;
    }
    if accepted {
        Ok(())
    } else {
        Err(MomentsError::Rejected(args.model.clone()))
    }
}

fn read(path: &Path, blob: &Blob<'_>) -> Result<Vec<References>, MomentsError> {
    let bytes = regular_file::read(path, REFERENCES_BYTES_MAX)?;
    let file: File = serde_json::from_slice(&bytes).map_err(|cause| MomentsError::Form {
        path: path.to_path_buf(),
        cause,
    })?;
    if file.blob_crc == blob.checksum() {
        Ok(file.references)
    } else {
        Err(MomentsError::OtherBlob {
            path: path.to_path_buf(),
            found: file.blob_crc,
            blob: blob.checksum(),
        })
    }
}
