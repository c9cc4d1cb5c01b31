//! What can be wrong with a scenario.

/// Why there is no scenario.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The name is not a built-in one and the file cannot be read.
    #[error("{file}: cannot read: {cause} (built in: {known})")]
    Io {
        /// The file.
        file: String,
        /// The names of the built-in scenarios.
        known: String,
        /// What the system said.
        cause: std::io::Error,
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
