//! A long file that is written piece by piece and appears when it is whole.
//!
//! What [`crate::atomic_file`] is for bytes in memory: until [`PendingFile::finish`] the file of that name is
//! what it was before. The pieces stand in a hidden file beside it; one that a killed run has left is written
//! over by the next.

use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::atomic_file::{AtomicWriteError, check_place, folder_of};

/// A file under construction; without [`PendingFile::finish`] it goes away.
#[derive(Debug)]
pub struct PendingFile {
    path: PathBuf,
    pending: PathBuf,
    file: File,
    is_finished: bool,
}

impl PendingFile {
    /// Begins the file that shall be at `path`. One process at a time writes it: that is the caller's care.
    ///
    /// # Errors
    /// As [`crate::atomic_file::write`].
    pub fn new(path: &Path) -> Result<Self, AtomicWriteError> {
        let begin = || {
            check_place(path)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let pending = folder_of(path).join(format!(".bnkf-pending-{name}"));
            match std::fs::remove_file(&pending) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            // A link that somebody puts there meanwhile is not followed.
            let mut options = OpenOptions::new();
            let file = options.write(true).create_new(true).open(&pending)?;
            Ok((pending, file))
        };
        let (pending, file) = begin().map_err(|cause| failed(path, cause))?;
        Ok(Self {
            path: path.to_owned(),
            pending,
            file,
            is_finished: false,
        })
    }

    /// Gives the file its name, replacing the regular file that was there in one step.
    ///
    /// # Errors
    /// As [`crate::atomic_file::write`].
    pub fn finish(mut self) -> Result<(), AtomicWriteError> {
        let appear = || {
            self.file.sync_all()?;
            check_place(&self.path)?;
            std::fs::rename(&self.pending, &self.path)
        };
        appear().map_err(|cause| failed(&self.path, cause))?;
        self.is_finished = true;
        Ok(())
    }
}

fn failed(path: &Path, cause: Error) -> AtomicWriteError {
    AtomicWriteError {
        path: path.to_owned(),
        cause,
    }
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Drop for PendingFile {
    fn drop(&mut self) {
        if !self.is_finished {
            // Nobody is left to be told; the next run writes over it.
            std::fs::remove_file(&self.pending).ok();
        }
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
    fn what_is_not_finished_leaves_nothing_and_what_was_killed_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(folder.path().join(".bnkf-pending-a.txt"), "killed").unwrap();
        let mut pending = PendingFile::new(&path).unwrap();
        pending.write_all(b"half").unwrap();
        drop(pending);
        assert!(names(folder.path()).is_empty());
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
