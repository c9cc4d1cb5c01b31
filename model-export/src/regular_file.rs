//! Whole files of bounded size.
//!
//! A path from outside may name a device that never ends, a pipe that never answers or a file that
//! fills the memory: what is read is a regular file, and no longer than the caller allows. Nothing
//! here panics.

use std::fs::{File, FileType, Metadata};
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Why a file was not read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {cause}", path.display())]
pub struct ReadFileError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong.
    #[source]
    pub cause: ReadFileCause,
}

/// What is wrong with a file that was to be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadFileCause {
    /// It is missing, or the system refuses.
    #[error("cannot read: {0}")]
    Io(#[from] std::io::Error),
    /// A folder, a device, a pipe or a socket.
    #[error("{0}, not a regular file")]
    NotRegular(&'static str),
    /// Longer than the caller allows.
    #[error("more than the {bytes_max} bytes that such a file has at most")]
    TooLarge {
        /// What is allowed.
        bytes_max: u64,
    },
}

impl ReadFileError {
    /// Whether there is nothing at the path.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(&self.cause, ReadFileCause::Io(error) if error.kind() == std::io::ErrorKind::NotFound)
    }
}

/// The bytes of the regular file at `path`, `bytes_max` at most. Symbolic links are followed.
///
/// # Errors
/// See [`ReadFileCause`]; a file that is too large or no file is refused before it is read.
pub fn read(path: &Path, bytes_max: u64) -> Result<Vec<u8>, ReadFileError> {
    read_bounded(path, bytes_max).map_err(|cause| ReadFileError {
        path: path.to_owned(),
        cause,
    })
}

/// Like [`read`], as text.
///
/// # Errors
/// As [`read`]; an [`std::io::ErrorKind::InvalidData`] for what is not UTF-8.
pub fn read_text(path: &Path, bytes_max: u64) -> Result<String, ReadFileError> {
    String::from_utf8(read(path, bytes_max)?).map_err(|_| ReadFileError {
        path: path.to_owned(),
        cause: ReadFileCause::Io(std::io::Error::new(
            std::io::ErrorKind::InvalidData,
            "not UTF-8 text",
        )),
    })
}

fn read_bounded(path: &Path, bytes_max: u64) -> Result<Vec<u8>, ReadFileCause> {
    // Before it is opened: opening a pipe waits for a writer, opening a device may act on it.
    check(&std::fs::metadata(path)?, bytes_max)?;
    let file = File::open(path)?;
    let status = file.metadata()?;
    check(&status, bytes_max)?;
    let mut bytes = Vec::with_capacity(usize::try_from(status.len()).unwrap_or(0));
    // A file that grows, or whose length is not known beforehand (/proc), is cut here.
    file.take(bytes_max.saturating_add(1))
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > bytes_max {
        return Err(ReadFileCause::TooLarge { bytes_max });
    }
    Ok(bytes)
}

fn check(status: &Metadata, bytes_max: u64) -> Result<(), ReadFileCause> {
    if !status.is_file() {
        return Err(ReadFileCause::NotRegular(kind(status.file_type())));
    }
    if status.len() > bytes_max {
        return Err(ReadFileCause::TooLarge { bytes_max });
    }
    Ok(())
}

/// What a path names, in words.
pub(crate) fn kind(file: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if file.is_char_device() {
            return "a character device";
        }
        if file.is_block_device() {
            return "a block device";
        }
        if file.is_fifo() {
            return "a pipe";
        }
        if file.is_socket() {
            return "a socket";
        }
    }
    if file.is_dir() {
        "a folder"
    } else if file.is_symlink() {
        "a symbolic link"
    } else if file.is_file() {
        "a regular file"
    } else {
        "something else"
    }
}

#[cfg(test)]
mod tests {
    use super::{ReadFileCause, read, read_text};
    use std::path::Path;

    #[test]
    fn a_file_is_read_up_to_its_bound() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, b"12345").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"12345");
        let error = read(&path, 4).unwrap_err();
        assert!(
            error
                .to_string()
                .ends_with("a: more than the 4 bytes that such a file has at most")
        );
        std::fs::write(&path, b"\xff").unwrap();
        let error = read_text(&path, 4).unwrap_err().to_string();
        assert!(error.ends_with("a: cannot read: not UTF-8 text"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn what_is_not_a_regular_file_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let socket = folder.path().join("socket");
        let _bound = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let cases = [
            (folder.path(), "a folder"),
            (Path::new("/dev/zero"), "a character device"),
            (&pipe, "a pipe"),
            (&socket, "a socket"),
        ];
        for (path, kind) in cases {
            let error = read(path, 1 << 20).unwrap_err();
            assert!(
                matches!(error.cause, ReadFileCause::NotRegular(found) if found == kind),
                "{error}"
            );
        }
        assert!(
            read(&folder.path().join("none"), 1)
                .unwrap_err()
                .is_missing()
        );
    }

    /// Files of /proc say that they are empty.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_length_that_is_not_true_is_not_believed() {
        let path = Path::new("/proc/self/status");
        assert_eq!(std::fs::metadata(path).unwrap().len(), 0);
        let error = read(path, 10).unwrap_err();
        assert!(matches!(
            error.cause,
            ReadFileCause::TooLarge { bytes_max: 10 }
        ));
    }
}
