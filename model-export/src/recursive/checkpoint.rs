//! A training run on disk: a sealed file of the network's numbers.

use super::network::Network;
use super::recipe::Recipe;
use crate::blob::sealed::{self, SealError};
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"BNKFrec1";

/// A run between two episodes.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// How it is made.
    pub recipe: Recipe,
    /// What it is made from.
    pub flights_hash: String,
    /// Episodes done.
    pub episode: u64,
    /// Weights and optimiser.
    pub network: Network,
}

/// Why bytes are not a checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// They are not a whole checkpoint of a recursive training run.
    #[error("not a usable checkpoint: it {0}")]
    Seal(#[from] SealError),
    /// The network has another shape, or the header other fields: another version wrote it.
    #[error("the checkpoint was written by another version")]
    OtherVersion,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    recipe: Recipe,
    flights_hash: String,
    episode: u64,
    updates: i32,
}

impl Checkpoint {
    /// The file's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (state, updates) = self.network.to_state();
        let header = serde_json::json!(Header {
            recipe: self.recipe.clone(),
            flights_hash: self.flights_hash.clone(),
            episode: self.episode,
            updates,
        })
        .to_string();
        sealed::seal(MAGIC, &header, state.into_iter())
    }

    /// The inverse of [`Self::to_bytes`].
    ///
    /// # Errors
    /// See [`CheckpointError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let (header, numbers) = sealed::open(MAGIC, bytes)?;
        let header: Header =
            serde_json::from_slice(header).map_err(|_| CheckpointError::OtherVersion)?;
        let network =
            Network::from_state(&numbers, header.updates).ok_or(CheckpointError::OtherVersion)?;
        Ok(Self {
            recipe: header.recipe,
            flights_hash: header.flights_hash,
            episode: header.episode,
            network,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint() -> Checkpoint {
        Checkpoint {
            recipe: Recipe::DEFAULT,
            flights_hash: "abc".to_owned(),
            episode: 7,
            network: Network::new(3),
        }
    }

    #[test]
    fn bytes_round_trip() {
        let bytes = checkpoint().to_bytes();
        let back = Checkpoint::parse(&bytes).unwrap();
        assert_eq!(back.to_bytes(), bytes);
        assert_eq!((back.episode, back.recipe), (7, Recipe::DEFAULT));
    }

    #[test]
    fn damage_is_found() {
        let bytes = checkpoint().to_bytes();
        for (length, error) in [
            (0, SealError::Magic),
            (7, SealError::Magic),
            (8, SealError::Damaged),
            (75, SealError::Damaged),
            (bytes.len() - 1, SealError::Damaged),
        ] {
            let refused = Checkpoint::parse(&bytes[..length]).unwrap_err();
            assert_eq!(refused, CheckpointError::Seal(error), "{length}");
        }
        for at in [9, 40, 5000] {
            let mut bad = bytes.clone();
            bad[at] ^= 1;
            let refused = Checkpoint::parse(&bad).unwrap_err();
            assert_eq!(refused, CheckpointError::Seal(SealError::Damaged));
        }
    }

    /// The layout of checkpoints that lie on disks already.
    #[test]
    fn the_file_is_magic_header_numbers_and_hash() {
        let bytes = checkpoint().to_bytes();
        assert_eq!(&bytes[..8], b"BNKFrec1");
        let header = u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize;
        let (numbers, _) = checkpoint().network.to_state();
        assert_eq!(bytes.len(), 12 + header + 4 * numbers.len() + 64);
        assert_eq!(bytes[12], b'{');
        let first = numbers[0].to_le_bytes();
        assert_eq!(bytes[12 + header..][..4], first);
    }
}
