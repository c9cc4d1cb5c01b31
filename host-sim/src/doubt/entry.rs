//! One way of being in doubt: a blob, a number of passes, or several blobs together.

use std::path::PathBuf;
use std::str::FromStr;

use bnkf::Inference;
use bnkf::blob::field::PASSES_MAX;

use crate::contest::model::{Model, ModelError};

/// What an argument names: `NAME=BLOB[+BLOB...][@PASSES]`, or `@moments`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name in the tables.
    pub name: String,
    /// Paths of the blobs.
    pub blobs: Vec<String>,
    /// How each is asked.
    pub inference: Inference,
}

/// Why an argument names nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EntryError {
    /// No `=` between name and blobs, or nothing on one side of it.
    #[error("{text:?} is not NAME=BLOB[+BLOB...][@PASSES]")]
    Form {
        /// The argument.
        text: String,
    },
    /// A number of passes that no tracker takes.
    #[error("{passes:?} is neither a number of passes from 1 to {PASSES_MAX} nor `moments`")]
    Passes {
        /// What follows the `@`.
        passes: String,
    },
}

impl FromStr for Entry {
    type Err = EntryError;

    fn from_str(text: &str) -> Result<Self, EntryError> {
        let form = || EntryError::Form {
            text: text.to_owned(),
        };
        let (name, rest) = text.split_once('=').ok_or_else(form)?;
        let (paths, inference) = match rest.rsplit_once('@') {
            Some((paths, passes)) => {
                let number = || passes.parse().ok();
                let fits = || number().filter(|number| (1..=PASSES_MAX).contains(number));
                let inference = match passes {
                    "moments" => Some(Inference::Moments),
                    _ => fits().and_then(|number| Inference::of_passes(number).ok()),
                };
                let refused = || EntryError::Passes {
                    passes: passes.to_owned(),
                };
                (paths, inference.ok_or_else(refused)?)
            }
            None => (rest, Inference::Mean),
        };
        let blobs: Vec<String> = paths.split('+').map(str::to_owned).collect();
        if name.is_empty() || blobs.iter().any(String::is_empty) {
            return Err(form());
        }
        Ok(Self {
            name: name.to_owned(),
            blobs,
            inference,
        })
    }
}

impl Entry {
    /// The files of its blobs.
    pub fn paths(&self) -> impl Iterator<Item = PathBuf> {
        self.blobs.iter().map(PathBuf::from)
    }

    /// Reads its blobs.
    ///
    /// # Errors
    /// One cannot be read or is none.
    pub fn models(&self) -> Result<Vec<Model>, ModelError> {
        self.paths().map(|path| Model::read(&path)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Entry, EntryError, Inference};

    #[test]
    fn arguments_mean_what_they_say() {
        let entry: Entry = "three=a.bnkf+b.bnkf+c.bnkf".parse().unwrap();
        assert_eq!(entry.blobs.len(), 3);
        assert_eq!(
            (entry.name.as_str(), entry.inference),
            ("three", Inference::Mean)
        );
        let moments: Entry = "x=a.bnkf@moments".parse().unwrap();
        assert_eq!(moments.inference, Inference::Moments);
        let sampled: Entry = "x=dir@2/a.bnkf@16".parse().unwrap();
        assert_eq!(
            (sampled.blobs[0].as_str(), sampled.inference),
            ("dir@2/a.bnkf", Inference::of_passes(16).unwrap())
        );
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["a.bnkf", "=a.bnkf", "x=", "x=a++b"] {
            let refused = text.parse::<Entry>().unwrap_err();
            assert!(matches!(refused, EntryError::Form { .. }), "{text}");
        }
        for text in ["x=a@0", "x=a@10001", "x=a@many"] {
            let refused = text.parse::<Entry>().unwrap_err();
            assert!(matches!(refused, EntryError::Passes { .. }), "{text}");
        }
    }
}
