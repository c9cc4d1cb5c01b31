//! A long file that is written piece by piece and appears when it is whole.
//!
//! What [`crate::atomic_file`] is for bytes in memory: until [`PendingFile::finish`] the file of that name is
//! what it was before. The pieces stand in a hidden file beside it, of a name that no other process has: of two
//! that write the same file each finishes a whole one, and the later stays. The writer holds a lock on its pieces,
//! so what a killed run has left is known, and the next removes it.

use std::fs::File;
use std::io::{Error, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::atomic_file::{AtomicWriteError, check_place, folder_of, temporary};

/// A file under construction; without [`PendingFile::finish`] it goes away.
#[derive(Debug)]
pub struct PendingFile {
    path: PathBuf,
    pending: NamedTempFile,
}

impl PendingFile {
    /// Begins the file that shall be at `path`.
    ///
    /// # Errors
    /// As [`crate::atomic_file::write`].
    pub fn new(path: &Path) -> Result<Self, AtomicWriteError> {
        let begin = || {
            check_place(path)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let (folder, own) = (folder_of(path), format!(".bnkf-pending-{name}"));
            remove_abandoned(folder, &own)?;
            locked(folder, &format!("{own}-"))
        };
        Ok(Self {
            pending: begin().map_err(|cause| failed(path, cause))?,
            path: path.to_owned(),
        })
    }

    /// Gives the file its name, replacing the regular file that was there in one step.
    ///
    /// # Errors
    /// As [`crate::atomic_file::write`].
    pub fn finish(self) -> Result<(), AtomicWriteError> {
        let Self { path, pending } = self;
        let appear = || {
            pending.as_file().sync_all()?;
            check_place(&path)?;
            pending.persist(&path).map_err(|failed| failed.error)
        };
        match appear() {
            Ok(_) => Ok(()),
            Err(cause) => Err(failed(&path, cause)),
        }
    }
}

/// A temporary file that this process holds a lock on.
fn locked(folder: &Path, prefix: &str) -> Result<NamedTempFile, Error> {
    loop {
        let pending = temporary(folder, prefix)?;
        // A file system without locks has no abandoned files that are known as such; it can be written to.
        let is_locked = pending.as_file().lock().is_ok();
        // Another process may have taken it for abandoned before it was locked.
        if !is_locked || pending.path().symlink_metadata().is_ok() {
            return Ok(pending);
        }
    }
}

/// Removes the pieces that killed runs have left: those that nobody holds a lock on.
fn remove_abandoned(folder: &Path, prefix: &str) -> Result<(), Error> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        if !name.to_string_lossy().starts_with(prefix) || !entry.file_type()?.is_file() {
            continue;
        }
        // What cannot be opened, locked or removed is somebody else's or gone already.
        let Ok(file) = File::open(entry.path()) else {
            continue;
        };
        if file.try_lock().is_ok() {
            std::fs::remove_file(entry.path()).ok();
        }
    }
    Ok(())
}

fn failed(path: &Path, cause: Error) -> AtomicWriteError {
    AtomicWriteError {
        path: path.to_owned(),
        cause,
    }
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.pending.as_file_mut().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.pending.as_file_mut().flush()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::path::Path;

    use super::PendingFile;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.collect()
    }

    #[test]
    fn the_old_file_stays_until_the_new_one_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "old").unwrap();
        let mut pending = PendingFile::new(&path).unwrap();
        pending.write_all(b"new ").unwrap();
        pending.write_all(b"text").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        pending.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new text");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn what_is_not_finished_leaves_nothing_and_what_was_killed_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for killed in [".bnkf-pending-a.txt", ".bnkf-pending-a.txt-Ab3dEf"] {
            std::fs::write(folder.path().join(killed), "killed").unwrap();
        }
        let mut pending = PendingFile::new(&path).unwrap();
        pending.write_all(b"half").unwrap();
        assert_eq!(names(folder.path()).len(), 1);
        drop(pending);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn two_that_write_the_same_file_each_finish_a_whole_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let mut first = PendingFile::new(&path).unwrap();
        first.write_all(b"first ").unwrap();
        let mut second = PendingFile::new(&path).unwrap();
        second.write_all(b"second").unwrap();
        first.write_all(b"whole").unwrap();
        first.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "first whole");
        second.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "second");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn what_cannot_be_written_is_named_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("taken")).unwrap();
        let refused = |name: &str| {
            let error = PendingFile::new(&folder.path().join(name)).unwrap_err();
            error.to_string()
        };
        assert!(refused("taken").contains("taken: cannot write: a folder is there"));
        assert!(refused("none/a").ends_with("its folder does not exist"));
    }
}
