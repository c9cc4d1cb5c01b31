//! Who does what, among processes that share a folder: a lock on a file that is there for nothing else.
//!
//! The system releases it when its process dies, however that happens: no claim outlives who made it. On a shared
//! file system the locks must be shared, too (NFS 4, CephFS, Lustre with `flock`).

use std::fs::{File, OpenOptions, TryLockError};
use std::io::Error;
use std::path::Path;

/// A lock, held until it is dropped.
#[derive(Debug)]
pub struct Claim {
    /// Held for the lock on it.
    _file: File,
}

impl Claim {
    /// The claim at `path` for this process alone; `None` while another holds it.
    ///
    /// # Errors
    /// The file cannot be made, or the file system has no locks.
    pub fn alone(path: &Path) -> Result<Option<Self>, Error> {
        let file = open(path)?;
        taken(file.try_lock(), file)
    }

    /// The same beside others that share it; `None` while one holds it alone.
    ///
    /// # Errors
    /// As [`Claim::alone`].
    pub fn shared(path: &Path) -> Result<Option<Self>, Error> {
        let file = open(path)?;
        taken(file.try_lock_shared(), file)
    }

    /// Waits until no other holds the claim, then holds it alone.
    ///
    /// # Errors
    /// As [`Claim::alone`].
    pub fn wait(path: &Path) -> Result<Self, Error> {
        let file = open(path)?;
        file.lock()?;
        Ok(Self { _file: file })
    }
}

fn open(path: &Path) -> Result<File, Error> {
    let mut options = OpenOptions::new();
    options.create(true).truncate(false).write(true).open(path)
}

fn taken(answer: Result<(), TryLockError>, file: File) -> Result<Option<Claim>, Error> {
    match answer {
        Ok(()) => Ok(Some(Claim { _file: file })),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(cause)) => Err(cause),
    }
}

#[cfg(test)]
mod tests {
    use super::Claim;

    #[test]
    fn one_alone_or_many_that_share() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.claim");
        let first = Claim::shared(&path).unwrap();
        let second = Claim::shared(&path).unwrap();
        assert!(first.is_some() && second.is_some());
        assert!(Claim::alone(&path).unwrap().is_none());
        drop((first, second));
        let alone = Claim::alone(&path).unwrap();
        assert!(alone.is_some());
        assert!(Claim::shared(&path).unwrap().is_none());
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| Claim::wait(&path).is_ok());
            drop(alone);
            assert!(waiting.join().unwrap());
        });
        assert!(Claim::alone(&folder.path().join("none/x.claim")).is_err());
    }
}
