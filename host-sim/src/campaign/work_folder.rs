//! Finished pieces of a long run, on disk: a run that was killed continues where it was.
//!
//! Every piece is a file that appears whole or not at all. The folder belongs to one plan: pieces
//! of another are never mixed in.

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::regular_file::{self, ReadFileError};
use serde::Serialize;
use serde::de::DeserializeOwned;

const PLAN: &str = "plan.json";
const LOCK: &str = "lock";

/// Longest piece, bytes.
const PIECE_BYTES_MAX: u64 = 1 << 32;

/// A folder of finished pieces, locked against other processes while it is open.
#[derive(Debug)]
pub struct WorkFolder {
    path: PathBuf,
    /// Held for the lock on it.
    _lock: File,
}

/// Why pieces cannot be kept.
#[derive(Debug, thiserror::Error)]
pub enum WorkFolderError {
    /// The system refused.
    #[error("{}: {cause}", path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// What it said.
        cause: std::io::Error,
    },
    /// A piece cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// A folder of somebody else: it would be removed with the last piece.
    #[error("{}: holds {name}, which is of no evaluation; choose another --out", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        name: String,
    },
    /// A piece cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Another process works here.
    #[error("{}: another run works in this folder", .0.display())]
    Busy(PathBuf),
    /// The pieces belong to other flights, settings or another version.
    #[error("{}: holds the pieces of another run; remove it or choose another --out", .0.display())]
    OtherPlan(PathBuf),
    /// A piece is not what this program writes.
    #[error("{}: damaged; remove it", .0.display())]
    Damaged(PathBuf),
}

impl WorkFolder {
    /// Opens `path` for the run that `plan` describes: empty, or with that run's pieces.
    ///
    /// # Errors
    /// See [`WorkFolderError`].
    pub fn open(path: &Path, plan: &str) -> Result<Self, WorkFolderError> {
        let io = |cause| WorkFolderError::Io {
            path: path.to_owned(),
            cause,
        };
        std::fs::create_dir_all(path).map_err(io)?;
        if let Some(name) = foreign(path).map_err(io)? {
            return Err(WorkFolderError::Foreign {
                path: path.to_owned(),
                name,
            });
        }
        atomic_file::check(&[path.join(LOCK), path.join(PLAN)])?;
        let lock = OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(path.join(LOCK))
            .map_err(io)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => {
                return Err(WorkFolderError::Busy(path.to_owned()));
            }
            Err(std::fs::TryLockError::Error(cause)) => return Err(io(cause)),
        }
        let folder = Self {
            path: path.to_owned(),
            _lock: lock,
        };
        match folder.bytes(PLAN)? {
            Some(found) if found != plan.as_bytes() => {
                return Err(WorkFolderError::OtherPlan(path.to_owned()));
            }
            Some(_) => {}
            None => folder.keep(PLAN, plan.as_bytes())?,
        }
        Ok(folder)
    }

    /// The bytes of a finished piece.
    ///
    /// # Errors
    /// The piece is there and cannot be read.
    pub fn bytes(&self, name: &str) -> Result<Option<Vec<u8>>, WorkFolderError> {
        match regular_file::read(&self.path.join(name), PIECE_BYTES_MAX) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.is_missing() => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Keeps the bytes of a piece.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> Result<(), WorkFolderError> {
        Ok(atomic_file::write(&self.path.join(name), bytes)?)
    }

    /// A finished piece.
    ///
    /// # Errors
    /// The piece is there and cannot be read.
    pub fn load<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, WorkFolderError> {
        let damaged = |_| WorkFolderError::Damaged(self.path.join(name));
        let bytes = self.bytes(name)?;
        bytes
            .map(|bytes| postcard::from_bytes(&bytes).map_err(damaged))
            .transpose()
    }

    /// Keeps a piece.
    ///
    /// # Errors
    /// The file cannot be written.
    ///
    /// # Panics
    /// Never: pieces are plain data.
    pub fn store<T: Serialize>(&self, name: &str, piece: &T) -> Result<(), WorkFolderError> {
        let bytes = postcard::to_stdvec(piece).expect("pieces are plain data");
        self.keep(name, &bytes)
    }

    /// Where the piece `name` is kept.
    pub fn path_of(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Removes the folder with all its pieces.
    ///
    /// # Errors
    /// The system refused.
    pub fn remove(self) -> Result<(), WorkFolderError> {
        std::fs::remove_dir_all(&self.path).map_err(|cause| WorkFolderError::Io {
            path: self.path.clone(),
            cause,
        })
    }
}

/// Something in a folder without a plan, which no evaluation has put there.
fn foreign(path: &Path) -> std::io::Result<Option<String>> {
    if path.join(PLAN).symlink_metadata().is_ok() {
        return Ok(None);
    }
    for entry in std::fs::read_dir(path)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        // What a run leaves that was killed before it wrote its plan.
        if name != LOCK && !name.starts_with(".bnkf-") {
            return Ok(Some(name));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::{WorkFolder, WorkFolderError};

    #[test]
    fn pieces_survive_and_other_plans_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("work");
        let folder = WorkFolder::open(&path, "plan a").unwrap();
        assert_eq!(folder.load::<Vec<f64>>("piece").unwrap(), None);
        folder.store("piece", &vec![0.1, -2.5e300]).unwrap();
        assert!(matches!(
            WorkFolder::open(&path, "plan a"),
            Err(WorkFolderError::Busy(_))
        ));
        drop(folder);

        assert!(matches!(
            WorkFolder::open(&path, "plan b"),
            Err(WorkFolderError::OtherPlan(_))
        ));
        let folder = WorkFolder::open(&path, "plan a").unwrap();
        assert_eq!(
            folder.load::<Vec<f64>>("piece").unwrap(),
            Some(vec![0.1, -2.5e300])
        );
        folder.remove().unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn a_folder_of_somebody_else_is_not_taken() {
        let root = tempfile::tempdir().unwrap();
        std::fs::write(root.path().join("thesis.tex"), "years").unwrap();
        let error = WorkFolder::open(root.path(), "plan").unwrap_err();
        assert!(error.to_string().contains("holds thesis.tex"), "{error}");
        assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_damaged_piece_is_named() {
        let root = tempfile::tempdir().unwrap();
        let folder = WorkFolder::open(root.path(), "plan").unwrap();
        std::fs::write(folder.path_of("piece"), [9]).unwrap();
        let error = folder.load::<Vec<f64>>("piece").unwrap_err();
        assert!(error.to_string().contains("piece: damaged"), "{error}");
    }
}
