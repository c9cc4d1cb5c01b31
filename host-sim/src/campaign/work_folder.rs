//! Finished pieces of a long run, on disk: a run that was killed continues where it was.
//!
//! Every piece is a file that appears whole or not at all, and ends with the hash of its bytes (blobs have
//! their own). The folder belongs to one plan: pieces
//! of another are never mixed in. Shards of one plan may share it: each piece has one writer at a time.

mod error;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use bnkf_model_export::atomic_file;
use bnkf_model_export::blob::sealed;
use bnkf_model_export::regular_file;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::claim::Claim;
use super::shard::Shard;
pub use error::WorkFolderError;

const PLAN: &str = "plan.json";
/// Held alone by a whole run and by a merge, shared by shards.
const LOCK: &str = "lock";
/// Ending of what shards and the makers of pieces hold.
const CLAIM: &str = "claim";

/// Most characters of a value that a message shows.
const VALUE_CHARACTERS_MAX: usize = 64;

/// Longest piece, bytes.
const PIECE_BYTES_MAX: u64 = 1 << 32;

/// Who works in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A run of everything; nobody else works here meanwhile.
    Alone,
    /// One of several that share it.
    Shard(Shard),
    /// Who puts finished pieces together; the folder must be there, and no shard may work.
    Merge,
}

/// A folder of finished pieces, locked against other processes while it is open.
#[derive(Debug)]
pub struct WorkFolder {
    path: PathBuf,
    /// More folders of the same plan to look for pieces in.
    others: Vec<WorkFolder>,
    _claims: Vec<Claim>,
}

impl WorkFolder {
    /// Opens `path` for the run that `plan` describes: empty, or with that run's pieces.
    ///
    /// # Errors
    /// See [`WorkFolderError`].
    pub fn open(path: &Path, plan: &str, role: Role) -> Result<Self, WorkFolderError> {
        let io = |cause| WorkFolderError::Io {
            path: path.to_owned(),
            cause,
        };
        if role == Role::Merge && path.join(PLAN).symlink_metadata().is_err() {
            return Err(WorkFolderError::Nothing(path.to_owned()));
        }
        std::fs::create_dir_all(path).map_err(io)?;
        if let Some(name) = foreign(path).map_err(io)? {
            return Err(WorkFolderError::Foreign {
                path: path.to_owned(),
                name,
            });
        }
        atomic_file::check(&[path.join(LOCK), path.join(PLAN)], &[])?;
        let lock = match role {
            Role::Alone | Role::Merge => Claim::alone(&path.join(LOCK)),
            Role::Shard(_) => Claim::shared(&path.join(LOCK)),
        };
        let lock = lock.map_err(io)?;
        let lock = lock.ok_or_else(|| WorkFolderError::Busy(path.to_owned()))?;
        let mut folder = Self {
            path: path.to_owned(),
            others: Vec::new(),
            _claims: vec![lock],
        };
        if let Role::Shard(shard) = role {
            let own = folder.enter(shard)?;
            folder._claims.push(own);
        }
        // Two shards that begin at once must not both find no plan.
        let _one_at_a_time = Claim::wait(&folder.claim_path(PLAN)).map_err(io)?;
        match folder.bytes(PLAN)? {
            Some(found) if found != plan.as_bytes() => {
                return Err(WorkFolderError::OtherPlan {
                    path: path.to_owned(),
                    differing: differing(&found, plan),
                });
            }
            Some(_) => {}
            None => folder.keep(PLAN, plan.as_bytes())?,
        }
        Ok(folder)
    }

    /// Opens the first of `paths` as [`WorkFolder::open`] does, and the others to look for pieces in.
    ///
    /// # Errors
    /// See [`WorkFolderError`].
    ///
    /// # Panics
    /// If there is none.
    pub fn open_all(paths: &[PathBuf], plan: &str, role: Role) -> Result<Self, WorkFolderError> {
        let mut folders = paths.iter().map(|path| Self::open(path, plan, role));
        let mut first = folders.next().expect("a folder")?;
        first.others = folders.collect::<Result<_, _>>()?;
        Ok(first)
    }

    /// The claim of `shard`, if no other process is this one, or one of another division.
    fn enter(&self, shard: Shard) -> Result<Claim, WorkFolderError> {
        let io = |cause| WorkFolderError::Io {
            path: self.path.clone(),
            cause,
        };
        let prefix = |count: usize| format!("shards-of-{count}-");
        let own_prefix = prefix(shard.count());
        let own = format!("{own_prefix}{}", shard.number());
        let claim = Claim::alone(&self.claim_path(&own)).map_err(io)?;
        let claim = claim.ok_or_else(|| WorkFolderError::SameShard {
            path: self.path.clone(),
            shard,
        })?;
        // Own first, then a look at the others: of two that begin at once one at least sees the other.
        for entry in std::fs::read_dir(&self.path).map_err(io)? {
            let name = entry
                .map_err(io)?
                .file_name()
                .to_string_lossy()
                .into_owned();
            let is_other = name.starts_with("shards-of-") && !name.starts_with(&own_prefix);
            if is_other && Claim::alone(&self.path.join(&name)).map_err(io)?.is_none() {
                return Err(WorkFolderError::OtherDivision {
                    path: self.path.clone(),
                    shard,
                    name,
                });
            }
        }
        Ok(claim)
    }

    fn claim_path(&self, name: &str) -> PathBuf {
        self.path.join(format!("{name}.{CLAIM}"))
    }

    /// The right to make the piece `name`; `None` while another process makes it.
    ///
    /// # Errors
    /// The system refused.
    pub fn claim(&self, name: &str) -> Result<Option<Claim>, WorkFolderError> {
        let path = self.claim_path(name);
        Claim::alone(&path).map_err(|cause| WorkFolderError::Io { path, cause })
    }

    /// Waits until nobody makes the piece `name`.
    ///
    /// # Errors
    /// The system refused.
    pub fn wait(&self, name: &str) -> Result<(), WorkFolderError> {
        let path = self.claim_path(name);
        match Claim::wait(&path) {
            Ok(_) => Ok(()),
            Err(cause) => Err(WorkFolderError::Io { path, cause }),
        }
    }

    /// Whether the piece `name` is there.
    pub fn has(&self, name: &str) -> bool {
        self.path_of(name).symlink_metadata().is_ok()
    }

    /// The bytes of a finished piece.
    ///
    /// # Errors
    /// The piece is there and cannot be read.
    pub fn bytes(&self, name: &str) -> Result<Option<Vec<u8>>, WorkFolderError> {
        match regular_file::read(&self.path_of(name), PIECE_BYTES_MAX) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.is_missing() => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Keeps the bytes of a piece.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> Result<(), WorkFolderError> {
        Ok(atomic_file::write(&self.path.join(name), bytes)?)
    }

    /// A finished piece.
    ///
    /// # Errors
    /// The piece is there and cannot be read, or is not what was kept.
    pub fn load<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, WorkFolderError> {
        let Some(bytes) = self.bytes(name)? else {
            return Ok(None);
        };
        let piece = sealed::without_hash(&bytes).map_err(|_| self.damaged(name))?;
        let piece = postcard::from_bytes(piece).map_err(|_| self.damaged(name))?;
        Ok(Some(piece))
    }

    /// What is said of pieces that are not there.
    pub fn missing(&self, names: Vec<String>) -> WorkFolderError {
        WorkFolderError::Missing {
            path: self.path.clone(),
            names,
        }
    }

    /// What a piece is whose contents make no sense.
    pub fn damaged(&self, name: &str) -> WorkFolderError {
        WorkFolderError::Damaged(self.path_of(name))
    }

    /// Keeps a piece.
    ///
    /// # Errors
    /// The file cannot be written.
    ///
    /// # Panics
    /// Never: pieces are plain data.
    pub fn store<T: Serialize>(&self, name: &str, piece: &T) -> Result<(), WorkFolderError> {
        let bytes = postcard::to_stdvec(piece).expect("pieces are plain data");
        self.keep(name, &sealed::with_hash(bytes))
    }

    /// Where the piece `name` is kept, or will be.
    pub fn path_of(&self, name: &str) -> PathBuf {
        let own = self.path.join(name);
        let others = self.others.iter().map(|other| other.path.join(name));
        let mut all = std::iter::once(own.clone()).chain(others);
        let found = all.find(|path| path.symlink_metadata().is_ok());
        found.unwrap_or(own)
    }

    /// Where pieces are written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes the folder with all its pieces.
    ///
    /// # Errors
    /// The system refused.
    pub fn remove(self) -> Result<(), WorkFolderError> {
        std::fs::remove_dir_all(&self.path).map_err(|cause| WorkFolderError::Io {
            path: self.path.clone(),
            cause,
        })
    }
}

/// What a plan of JSON has otherwise than another, each with the value there and the value here.
fn differing(found: &[u8], plan: &str) -> Vec<String> {
    let parsed: (Result<Map<_, _>, _>, Result<Map<_, _>, _>) =
        (serde_json::from_slice(found), serde_json::from_str(plan));
    let (Ok(found), Ok(plan)) = parsed else {
        return Vec::new();
    };
    let all: BTreeSet<&String> = found.keys().chain(plan.keys()).collect();
    let value = |of: &Map<String, Value>, key: &str| match of.get(key) {
        None => "nothing".to_owned(),
        Some(value) => {
            let text = value.to_string();
            let mut short: String = text.chars().take(VALUE_CHARACTERS_MAX).collect();
            if short.len() < text.len() {
                short += "..";
            }
            short
        }
    };
    let other = |key: &&String| found.get(*key) != plan.get(*key);
    all.into_iter()
        .filter(other)
        .map(|key| match (value(&found, key), value(&plan, key)) {
            // Long ones may begin alike.
            (there, here) if there == here => key.clone(),
            (there, here) => format!("{key} = {there}, now {here}"),
        })
        .collect()
}

/// Something in a folder without a plan, which no evaluation has put there.
fn foreign(path: &Path) -> std::io::Result<Option<String>> {
    if path.join(PLAN).symlink_metadata().is_ok() {
        return Ok(None);
    }
    for entry in std::fs::read_dir(path)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        // What a run leaves that was killed before it wrote its plan.
        let is_claim = name.ends_with(&format!(".{CLAIM}"));
        if name != LOCK && !is_claim && !name.starts_with(".bnkf-") {
            return Ok(Some(name));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::{Role, Shard, WorkFolder, WorkFolderError};

    #[test]
    fn pieces_survive_and_other_plans_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("work");
        let folder = WorkFolder::open(&path, "plan a", Role::Alone).unwrap();
        assert_eq!(folder.load::<Vec<f64>>("piece").unwrap(), None);
        folder.store("piece", &vec![0.1, -2.5e300]).unwrap();
        assert!(matches!(
            WorkFolder::open(&path, "plan a", Role::Alone),
            Err(WorkFolderError::Busy(_))
        ));
        drop(folder);

        assert!(matches!(
            WorkFolder::open(&path, "plan b", Role::Alone),
            Err(WorkFolderError::OtherPlan { .. })
        ));
        let folder = WorkFolder::open(&path, "plan a", Role::Alone).unwrap();
        assert_eq!(
            folder.load::<Vec<f64>>("piece").unwrap(),
            Some(vec![0.1, -2.5e300])
        );
        folder.remove().unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn a_folder_of_somebody_else_is_not_taken() {
        let root = tempfile::tempdir().unwrap();
        std::fs::write(root.path().join("thesis.tex"), "years").unwrap();
        let error = WorkFolder::open(root.path(), "plan", Role::Alone).unwrap_err();
        assert!(error.to_string().contains("holds thesis.tex"), "{error}");
        assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_damaged_piece_is_named() {
        let root = tempfile::tempdir().unwrap();
        let folder = WorkFolder::open(root.path(), "plan", Role::Alone).unwrap();
        std::fs::write(folder.path_of("piece"), [9]).unwrap();
        let error = folder.load::<Vec<f64>>("piece").unwrap_err();
        assert!(error.to_string().contains("piece: damaged"), "{error}");
    }

    #[test]
    fn a_flipped_bit_anywhere_in_a_piece_is_damage() {
        let root = tempfile::tempdir().unwrap();
        let folder = WorkFolder::open(root.path(), "plan", Role::Alone).unwrap();
        folder.store("piece", &vec![0.5, 1.5]).unwrap();
        let whole = folder.bytes("piece").unwrap().unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            folder.keep("piece", &bytes).unwrap();
            let error = folder.load::<Vec<f64>>("piece").unwrap_err();
            assert!(
                matches!(error, WorkFolderError::Damaged(_)),
                "{at}: {error}"
            );
        }
    }

    #[test]
    fn what_differs_between_two_plans_is_named() {
        let root = tempfile::tempdir().unwrap();
        let open = |plan| WorkFolder::open(root.path(), plan, Role::Alone);
        let list = format!("[{}0]", "1,".repeat(99));
        let first = format!("{{\"folds\": 2, \"list\": {list}, \"old\": 1, \"seed\": 7}}");
        open(&first).unwrap();
        let error = open("{\"folds\": 2, \"list\": [1], \"seed\": 8}").unwrap_err();
        let cut = "1,".repeat(31);
        let expected = format!(
            "holds the pieces of another run: list = [{cut}1.., now [1]; old = 1, now nothing; seed = 7, now 8; remove it"
        );
        assert!(error.to_string().contains(&expected), "{error}");
    }

    #[test]
    fn shards_share_a_folder_and_nobody_else_does() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("work");
        let open = |role| WorkFolder::open(&path, "plan", role);
        let shard = |number, count| Role::Shard(Shard::new(number, count).unwrap());
        assert!(matches!(
            open(Role::Merge),
            Err(WorkFolderError::Nothing(_))
        ));
        let first = open(shard(1, 2)).unwrap();
        let second = open(shard(2, 2)).unwrap();
        for role in [Role::Alone, Role::Merge] {
            assert!(matches!(open(role), Err(WorkFolderError::Busy(_))));
        }
        let same = open(shard(2, 2)).unwrap_err().to_string();
        assert!(
            same.ends_with("work: another process is shard 2/2"),
            "{same}"
        );
        let other = open(shard(3, 3)).unwrap_err();
        assert!(
            matches!(other, WorkFolderError::OtherDivision { .. }),
            "{other}"
        );

        // A piece has one maker at a time; who comes later finds it.
        let claim = first.claim("piece").unwrap();
        assert!(claim.is_some() && second.claim("piece").unwrap().is_none());
        first.store("piece", &7_u8).unwrap();
        drop(claim);
        second.wait("piece").unwrap();
        assert!(second.has("piece") && !second.has("other"));
        assert_eq!(second.load::<u8>("piece").unwrap(), Some(7));
        drop((first, second));
        open(shard(3, 3)).unwrap();
        assert_eq!(
            open(Role::Merge).unwrap().load("piece").unwrap(),
            Some(7_u8)
        );
    }

    #[test]
    fn pieces_are_looked_for_in_every_folder() {
        let root = tempfile::tempdir().unwrap();
        let paths = ["a", "b"].map(|name| root.path().join(name));
        for (path, piece) in paths.iter().zip(["one", "two"]) {
            let folder = WorkFolder::open(path, "plan", Role::Alone).unwrap();
            folder.store(piece, &piece.to_owned()).unwrap();
        }
        let all = WorkFolder::open_all(&paths, "plan", Role::Merge).unwrap();
        for piece in ["one", "two"] {
            assert_eq!(all.load(piece).unwrap(), Some(piece.to_owned()));
        }
        assert!(!all.has("three"));
        drop(all);
        let error = WorkFolder::open_all(&paths, "other", Role::Merge).unwrap_err();
        assert!(
            matches!(error, WorkFolderError::OtherPlan { .. }),
            "{error}"
        );
    }
}
