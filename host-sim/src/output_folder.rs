//! The folder of a command's results: made, tried and looked through before the work begins.

use std::path::{Path, PathBuf};

use bnkf_model_export::atomic_file::{self, AtomicWriteError};

/// Endings of everything that commands write.
const ENDINGS: [&str; 6] = ["csv", "html", "json", "md", "parquet", "svg"];

/// Why a folder cannot take results.
#[derive(Debug, thiserror::Error)]
pub enum OutputFolderError {
    /// It cannot be made or looked through.
    #[error("{}: cannot make the folder: {cause}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// It is read-only or full, something else than a file has the name of a result, or an input has.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
}

/// Makes `folder` where it is missing and checks that results can be written there, without the loss of one of `inputs`:
/// none of them is one of `names`, which are to be written. What has the ending of a result must be a regular file:
/// nothing else is replaced.
///
/// # Errors
/// See [`OutputFolderError`].
pub fn prepare(folder: &Path, names: &[&str], inputs: &[PathBuf]) -> Result<(), OutputFolderError> {
    let failed = |cause| OutputFolderError::Folder {
        path: folder.to_owned(),
        cause,
    };
    std::fs::create_dir_all(folder).map_err(failed)?;
    // A name that nothing else has.
    let mut places = vec![folder.join(".bnkf-results.json")];
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let ending = path.extension().and_then(|ending| ending.to_str());
        if ending.is_some_and(|ending| ENDINGS.contains(&ending)) {
            places.push(path);
        }
    }
    places[1..].sort();
    atomic_file::check(&places, &[])?;
    let written: Vec<_> = names.iter().map(|name| folder.join(name)).collect();
    Ok(atomic_file::check_inputs(&written, inputs)?)
}

#[cfg(test)]
mod tests {
    use super::prepare;

    #[test]
    fn a_folder_is_made_and_left_as_it_was() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        prepare(&folder, &[], &[]).unwrap();
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        std::fs::write(folder.join("results.json"), "mine").unwrap();
        std::fs::create_dir(folder.join("work")).unwrap();
        prepare(&folder, &[], &[]).unwrap();
        let text = std::fs::read_to_string(folder.join("results.json")).unwrap();
        assert_eq!(text, "mine");

        std::fs::create_dir(folder.join("report.html")).unwrap();
        let error = prepare(&folder, &[], &[]).unwrap_err().to_string();
        assert!(
            error.contains("report.html: cannot write: a folder is there"),
            "{error}"
        );
        let error = prepare(&folder.join("results.json/below"), &[], &[]).unwrap_err();
        assert!(
            error.to_string().contains("below: cannot make the folder"),
            "{error}"
        );
    }

    #[test]
    fn an_input_may_lie_beside_the_results_and_not_in_their_place() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("cells.csv");
        std::fs::write(&input, "mine").unwrap();
        let inputs = [input];
        prepare(folder.path(), &["bins.csv"], &inputs).unwrap();
        let names = ["bins.csv", "cells.csv"];
        let error = prepare(folder.path(), &names, &inputs).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("cells.csv: cannot write: it is an input"),
            "{error}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_link_with_the_name_of_a_result_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("elsewhere", folder.path().join("cells.csv")).unwrap();
        let error = prepare(folder.path(), &[], &[]).unwrap_err().to_string();
        assert!(
            error.contains("cells.csv: cannot write: a symbolic link is there"),
            "{error}"
        );
    }
}
