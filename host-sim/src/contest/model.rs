//! A trained blob and where it came from.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bnkf::blob::{Blob, BlobError, Kind};
use bnkf_model_export::blob::unrounded;
use bnkf_model_export::cmd::blob_file::BLOB_BYTES_MAX;
use bnkf_model_export::flights::data_hash;
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::recursive::tunable::{Tunable, UntunableError, tunable};
use bnkf_model_export::regular_file::{self, ReadFileError};

/// A blob that was checked.
#[derive(Clone, Debug)]
pub struct Model {
    /// Its path, or `embedded:` and its name.
    pub source: String,
    bytes: Cow<'static, [u8]>,
    unrounded: Unrounded,
}

/// Where the weights lie that a blob was rounded from.
#[derive(Clone, Debug)]
enum Unrounded {
    Embedded(&'static [u8]),
    Beside(PathBuf),
}

/// Why a model cannot be tuned.
#[derive(Debug, thiserror::Error)]
pub enum ToTuneError {
    /// The unrounded weights cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// They do not belong to it, or it is of another kind.
    #[error("{name}: {cause}")]
    Untunable {
        /// The blob.
        name: String,
        /// What is wrong.
        cause: UntunableError,
    },
}

/// Why a blob file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file cannot be read, is none, or is larger than any blob.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// The bytes are not a blob.
    #[error("{name}: {cause}")]
    Blob {
        /// Where the bytes came from.
        name: String,
        /// What is wrong with them.
        cause: BlobError,
    },
}

impl Model {
    /// Reads and checks a blob file.
    ///
    /// # Errors
    /// The file cannot be read or is not a blob.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        let bytes = regular_file::read(path, BLOB_BYTES_MAX)?;
        let unrounded = Unrounded::Beside(unrounded::path_beside(path));
        Self::checked(path.display().to_string(), bytes.into(), unrounded)
    }

    /// Checks a blob that is part of this program; `unrounded` is what it was rounded from.
    ///
    /// # Errors
    /// The bytes are not a blob.
    pub fn embedded(
        name: &str,
        bytes: &'static [u8],
        unrounded: &'static [u8],
    ) -> Result<Self, ModelError> {
        let unrounded = Unrounded::Embedded(unrounded);
        Self::checked(format!("embedded:{name}"), bytes.into(), unrounded)
    }

    /// The model as tuning goes on from it.
    ///
    /// # Errors
    /// See [`ToTuneError`].
    pub fn to_tune(&self) -> Result<Tunable, ToTuneError> {
        let unrounded = match &self.unrounded {
            Unrounded::Embedded(bytes) => Cow::Borrowed(*bytes),
            Unrounded::Beside(path) => regular_file::read(path, unrounded::BYTES_MAX)?.into(),
        };
        tunable(&self.bytes, &unrounded).map_err(|cause| ToTuneError::Untunable {
            name: self.source.clone(),
            cause,
        })
    }

    fn checked(
        source: String,
        bytes: Cow<'static, [u8]>,
        unrounded: Unrounded,
    ) -> Result<Self, ModelError> {
        match Blob::parse(&bytes) {
            Ok(_) => Ok(Self {
                source,
                bytes,
                unrounded,
            }),
            Err(cause) => Err(ModelError::Blob {
                name: source,
                cause,
            }),
        }
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The view over its bytes.
    ///
    /// # Panics
    /// Never: the bytes were checked and cannot change.
    pub fn blob(&self) -> Blob<'_> {
        Blob::parse(&self.bytes).expect("the bytes were checked when the model was made")
    }

    /// What a method asks of the model that it runs on: its kind, and how many networks.
    pub fn form(&self) -> (Kind, usize) {
        (self.blob().kind(), self.blob().network_count())
    }

    /// Where a recursive model expects its targets, by the ranges that it starts from; `None` for
    /// other kinds.
    pub fn volume(&self) -> Option<Volume> {
        let blob = self.blob();
        if blob.kind() != Kind::Recursive {
            return None;
        }
        let parameter = |index| f64::from(blob.parameters().get(index));
        let (range_m_mean, range_m_sd) = (parameter(0), parameter(1));
        let range_m_max = range_m_mean + 3.0 * range_m_sd;
        Some(Volume {
            range_m_min: (range_m_mean - 3.0 * range_m_sd).max(0.0),
            range_m_max,
            range_m_mean,
            range_m_sd,
            height_m_min: -range_m_max,
            height_m_max: range_m_max,
        })
    }

    /// SHA-256 of the bytes, as `sha256sum` prints it.
    pub fn sha256(&self) -> String {
        data_hash::of_bytes(&self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Model;

    #[test]
    fn errors_name_the_file() {
        let missing = Model::read(Path::new("/nowhere/m.bnkf")).unwrap_err();
        assert!(
            missing
                .to_string()
                .starts_with("/nowhere/m.bnkf: cannot read")
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.bnkf");
        std::fs::write(&path, b"not a blob").unwrap();
        let malformed = Model::read(&path).unwrap_err().to_string();
        assert!(
            malformed.starts_with(&format!("{}: ", path.display())),
            "{malformed}"
        );
    }
}
