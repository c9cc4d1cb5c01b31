//! A file that appears complete or not at all.
//!
//! The bytes go to a temporary file in the same folder, which then takes the final name: a crash, a
//! kill or a full disk leaves the old file, or none, and never half a file. Only regular files are
//! replaced: not a device, not a folder, and not a symbolic link, which would be lost; and no file that the
//! same command reads. What cannot be written is found out by [`check`] before the work.

use crate::regular_file::kind;
use std::io::{Error, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What must fit into the folder of an output before the work begins, bytes: more than a blob and
/// all that lies beside it.
const ROOM_BYTES: usize = 1 << 20;
/// Beginning of the names of temporary files: hidden, so that nothing takes them for inputs.
const PREFIX: &str = ".bnkf-";

/// Writing a file failed, or would fail.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot write: {cause}", path.display())]
pub struct AtomicWriteError {
    /// The file that was to be written.
    pub path: PathBuf,
    /// What the system said.
    #[source]
    pub cause: Error,
}

/// Writes `bytes` to `path`, replacing the regular file that was there in one step.
///
/// # Errors
/// The folder does not exist or cannot be written, the disk is full, or something else than a
/// regular file is there; `path` is then unchanged.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), AtomicWriteError> {
    write_and_rename(path, bytes).map_err(|cause| AtomicWriteError {
        path: path.to_owned(),
        cause,
    })
}

/// Finds out whether [`write()`] can write every one of `paths` for a command that reads `inputs`. Leaves nothing
/// behind.
///
/// # Errors
/// The first path for which it cannot; the folder has no room for a megabyte; a file is protected
/// against writing, or as [`check_inputs`].
pub fn check<P: AsRef<Path>>(paths: &[P], inputs: &[PathBuf]) -> Result<(), AtomicWriteError> {
    check_inputs(paths, inputs)?;
    let mut tried: Vec<&Path> = Vec::new();
    for path in paths {
        let path = path.as_ref();
        let failed = |cause| AtomicWriteError {
            path: path.to_owned(),
            cause,
        };
        check_place(path).map_err(failed)?;
        let folder = folder_of(path);
        if !tried.contains(&folder) {
            try_folder(folder).map_err(failed)?;
            tried.push(folder);
        }
    }
    Ok(())
}

/// Finds out whether one of `paths` is one of `inputs`, which would be lost: by another spelling or through a link, too.
///
/// # Errors
/// The first that is.
pub fn check_inputs<P: AsRef<Path>>(
    paths: &[P],
    inputs: &[PathBuf],
) -> Result<(), AtomicWriteError> {
    let inputs: Vec<_> = inputs
        .iter()
        .filter_map(|input| Some((identity(input)?, input)))
        .collect();
    for path in paths {
        let path = path.as_ref();
        // What is not there yet is no input.
        let Some(own) = identity(path) else { continue };
        if let Some((_, input)) = inputs.iter().find(|(other, _)| *other == own) {
            let cause = format!("it is an input of this command, {}", input.display());
            return Err(AtomicWriteError {
                path: path.to_owned(),
                cause: Error::new(ErrorKind::AlreadyExists, cause),
            });
        }
    }
    Ok(())
}

/// What two paths to the same file have in common: device and number.
#[cfg(unix)]
fn identity(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    let status = std::fs::metadata(path).ok()?;
    Some((status.dev(), status.ino()))
}

/// What two paths to the same file have in common.
#[cfg(not(unix))]
fn identity(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok()
}

pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Whether a regular file is at `path`, or nothing yet.
pub(crate) fn check_place(path: &Path) -> Result<(), Error> {
    let spelt = path.as_os_str().as_encoded_bytes();
    if path.file_name().is_none() || spelt.ends_with(b"/") {
        return Err(Error::new(ErrorKind::IsADirectory, "it names no file"));
    }
    let folder = folder_of(path);
    match std::fs::metadata(folder) {
        Ok(status) if status.is_dir() => {}
        Ok(_) => return Err(Error::new(ErrorKind::NotADirectory, "its folder is a file")),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return Err(Error::new(error.kind(), "its folder does not exist"));
        }
        Err(error) => return Err(error),
    }
    // Of the path itself: a link is not followed.
    match std::fs::symlink_metadata(path) {
        Ok(status) if status.is_file() => {
            // Neither cut nor written to; a protected file says so here.
            std::fs::OpenOptions::new().append(true).open(path)?;
            Ok(())
        }
        Ok(status) => Err(Error::new(
            ErrorKind::AlreadyExists,
            format!(
                "{} is there, and only a regular file is replaced",
                kind(status.file_type())
            ),
        )),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

/// Writes a megabyte into `folder` and takes it away again.
fn try_folder(folder: &Path) -> Result<(), Error> {
    let mut file = temporary(folder, PREFIX)?;
    let file = file.as_file_mut();
    file.write_all(&vec![0; ROOM_BYTES])?;
    // Some file systems notice only now that they are full.
    file.sync_data()
}

/// A file of a name that nobody else has, `prefix` and a few random letters, which goes away unless it is renamed.
///
/// Its errors are the system's: those of tempfile name the temporary file, which says nothing to anybody. For the
/// same reason it is written to through [`tempfile::NamedTempFile::as_file_mut`].
pub(crate) fn temporary(folder: &Path, prefix: &str) -> Result<tempfile::NamedTempFile, Error> {
    let mut cause = None;
    let open = |path: &Path| {
        // As readable as any other file, not private as a temporary one; a link there is not followed.
        let mut options = std::fs::OpenOptions::new();
        let file = options.read(true).write(true).create_new(true).open(path);
        file.inspect_err(|error| cause = error.raw_os_error())
    };
    let made = tempfile::Builder::new()
        .prefix(prefix)
        .make_in(folder, open);
    made.map_err(|error| cause.map_or(error, Error::from_raw_os_error))
}

fn write_and_rename(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    check_place(path)?;
    let mut file = temporary(folder_of(path), PREFIX)?;
    file.as_file_mut().write_all(bytes)?;
    // Without this a power cut can leave the new name on an empty file.
    file.as_file().sync_all()?;
    // Again: the work between took its time.
    check_place(path)?;
    file.persist(path).map_err(|failed| failed.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{check, write};
    use std::path::Path;

    #[test]
    fn the_file_is_replaced_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"first").unwrap();
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_failed_write_names_the_file_and_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing").join("a.txt");
        let error = write(&missing, b"x").unwrap_err();
        assert!(
            error
                .to_string()
                .ends_with("a.txt: cannot write: its folder does not exist"),
            "{error}"
        );

        // A folder in the file's place: the rename fails and the temporary file goes away.
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        write(&taken, b"x").unwrap_err();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn others_can_read_it_as_far_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write(&ours, b"x").unwrap();
        std::fs::write(&plain, b"x").unwrap();
        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[cfg(unix)]
    #[test]
    fn devices_pipes_links_and_folders_are_refused_and_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("file"), b"mine").unwrap();
        std::os::unix::fs::symlink(path("file"), path("link")).unwrap();
        std::os::unix::fs::symlink(path("nothing"), path("dangling")).unwrap();
        std::fs::create_dir(path("folder")).unwrap();
        let made = |program: &str, arguments: &[&str]| {
            let mut command = std::process::Command::new(program);
            let status = command.args(arguments).current_dir(folder.path()).status();
            status.is_ok_and(|status| status.success())
        };
        assert!(made("mkfifo", &["pipe"]));
        let mut cases = vec![
            ("link", "a symbolic link"),
            ("dangling", "a symbolic link"),
            ("folder", "a folder"),
            ("pipe", "a pipe"),
        ];
        // A copy of /dev/null; only root makes one.
        if made("mknod", &["device", "c", "1", "3"]) {
            cases.push(("device", "a character device"));
        }
        for (name, kind) in cases {
            let before = std::fs::symlink_metadata(path(name)).unwrap().file_type();
            let expected = format!(
                "{}: cannot write: {kind} is there, and only a regular file is replaced",
                path(name).display()
            );
            let refused = check(&[path(name)], &[]).unwrap_err().to_string();
            assert_eq!(refused, expected);
            let refused = write(&path(name), b"x").unwrap_err().to_string();
            assert_eq!(refused, expected);
            let after = std::fs::symlink_metadata(path(name)).unwrap().file_type();
            assert_eq!(before, after, "{name}");
        }
        assert_eq!(std::fs::read(path("file")).unwrap(), b"mine");
        assert!(!path("nothing").exists());
    }

    #[test]
    fn a_check_says_what_a_write_would_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        check(&[path("a"), path("b")], &[]).unwrap();
        std::fs::write(path("file"), b"mine").unwrap();
        check(&[path("file")], &[]).unwrap();
        assert_eq!(std::fs::read(path("file")).unwrap(), b"mine");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let refused = |path: &Path| check(&[path], &[]).unwrap_err().to_string();
        assert!(refused(&path("none/a")).ends_with("its folder does not exist"));
        assert!(refused(&path("file/a")).ends_with("its folder is a file"));
        assert!(refused(&path("new/")).ends_with("it names no file"));
        assert!(refused(Path::new("")).ends_with("it names no file"));
        assert!(refused(&path(&"x".repeat(300))).contains("cannot write: "));
        // Not even root makes files there.
        #[cfg(target_os = "linux")]
        for path in ["/proc/self/m.bnkf", "/proc/m.bnkf"] {
            let refused = refused(Path::new(path));
            assert!(
                refused.starts_with(&format!("{path}: cannot write: ")),
                "{refused}"
            );
            assert!(!refused.contains(".bnkf-"), "{refused}");
        }
    }

    #[test]
    fn an_input_is_not_written_over_by_whatever_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("in"), b"mine").unwrap();
        std::fs::write(path("other"), b"mine").unwrap();
        std::fs::create_dir(path("below")).unwrap();
        let refused = |out: &str, input: &str| {
            let answer = check(&[path("new"), path(out)], &[path("none"), path(input)]);
            answer.map_err(|error| error.to_string())
        };
        let expected = |out: &str, input: &str| {
            let [out, input] = [path(out), path(input)];
            Err(format!(
                "{}: cannot write: it is an input of this command, {}",
                out.display(),
                input.display()
            ))
        };
        assert_eq!(refused("in", "in"), expected("in", "in"));
        let around = "below/../in";
        assert_eq!(refused(around, "in"), expected(around, "in"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(path("in"), path("soft")).unwrap();
            assert_eq!(refused("in", "soft"), expected("in", "soft"));
        }
        std::fs::hard_link(path("in"), path("hard")).unwrap();
        assert_eq!(refused("hard", "in"), expected("hard", "in"));
        assert_eq!(refused("other", "in"), Ok(()));
        assert_eq!(refused("none", "none"), Ok(()));
    }

    /// Where root may mount a file system of 64 KB.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_folder_is_found_by_the_check() {
        let folder = tempfile::tempdir().unwrap();
        let mount = |arguments: &[&str]| {
            let mut command = std::process::Command::new("mount");
            let status = command.args(arguments).arg(folder.path()).output();
            status.is_ok_and(|output| output.status.success())
        };
        if !mount(&["-t", "tmpfs", "-o", "size=64k", "tmpfs"]) {
            return;
        }
        let error = check(&[folder.path().join("m.bnkf")], &[]).map_err(|error| error.to_string());
        let read_only = mount(&["-o", "remount,ro"]).then(|| {
            check(&[folder.path().join("m.bnkf")], &[]).map_err(|error| error.to_string())
        });
        let unmounted = std::process::Command::new("umount")
            .arg(folder.path())
            .status();
        assert!(unmounted.unwrap().success());
        assert!(
            error.as_ref().unwrap_err().contains("No space left"),
            "{error:?}"
        );
        if let Some(error) = read_only {
            assert!(
                error.as_ref().unwrap_err().contains("Read-only"),
                "{error:?}"
            );
        }
    }
}
