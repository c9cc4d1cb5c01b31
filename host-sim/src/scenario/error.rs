//! What can be wrong with a scenario.

use bnkf_model_export::regular_file::ReadFileError;

/// Why there is no scenario.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The name is not a built-in one and the file cannot be read.
    #[error("{cause} (built in: {known})")]
    Read {
        /// The names of the built-in scenarios.
        known: String,
        /// Which file, and why not.
        cause: ReadFileError,
    },
    /// A line is wrong.
    #[error("{file}:{line}: {message}")]
    Line {
        /// The file.
        file: String,
        /// Its line, counted from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
}
