//! Why pieces cannot be kept.

use std::path::PathBuf;

use bnkf_model_export::atomic_file::AtomicWriteError;
use bnkf_model_export::regular_file::ReadFileError;

use super::Shard;

/// Missing pieces that are named; the others are counted.
const NAMES_MAX: usize = 12;

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
    /// The same shard is at work already.
    #[error("{}: another process is shard {shard}", path.display())]
    SameShard {
        /// The folder.
        path: PathBuf,
        /// The shard.
        shard: Shard,
    },
    /// Shards of another division would make the same pieces.
    #[error("{}: shards of another number than {shard} are at work: {name}", path.display())]
    OtherDivision {
        /// The folder.
        path: PathBuf,
        /// The shard that was to begin.
        shard: Shard,
        /// What one of the others holds.
        name: String,
    },
    /// Nothing to put together.
    #[error("{}: holds no pieces of an evaluation", .0.display())]
    Nothing(PathBuf),
    /// The pieces belong to other flights, settings or another version.
    #[error("{}: holds the pieces of another run{}; remove it or choose another --out", path.display(), listed(differing))]
    OtherPlan {
        /// The folder.
        path: PathBuf,
        /// What differs; empty if its plan makes no sense.
        differing: Vec<String>,
    },
    /// Pieces that nobody has made yet.
    #[error("{}: {} of its pieces are missing: {}; run their shards again", path.display(), names.len(), few(names))]
    Missing {
        /// The folder.
        path: PathBuf,
        /// Names of the pieces.
        names: Vec<String>,
    },
    /// A piece is not what this program writes.
    #[error("{}: damaged; remove it", .0.display())]
    Damaged(PathBuf),
}

/// Behind a colon, if there are any.
fn listed(differing: &[String]) -> String {
    if differing.is_empty() {
        return String::new();
    }
    format!(": {}", differing.join("; "))
}

/// The first names of many.
fn few(names: &[String]) -> String {
    let shown = names.len().min(NAMES_MAX);
    let rest = match names.len() - shown {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("{}{rest}", names[..shown].join(", "))
}

#[cfg(test)]
mod tests {
    use super::{NAMES_MAX, few};

    #[test]
    fn a_few_are_named_and_the_others_counted() {
        let names = |count: usize| (0..count).map(|n| n.to_string()).collect::<Vec<_>>();
        assert_eq!(few(&names(3)), "0, 1, 2");
        assert!(few(&names(NAMES_MAX)).ends_with(", 11"));
        assert!(few(&names(NAMES_MAX + 2)).ends_with(", 11 and 2 more"));
    }
}
