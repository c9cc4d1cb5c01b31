//! A training run on disk.
//!
//! Layout: eight bytes of magic, the length of the header (u32, little-endian), the header as JSON,
//! the network's numbers (f32, little-endian), SHA-256 of all that in hexadecimal.

use super::network::Network;
use super::recipe::Recipe;
use crate::flights::data_hash::of_bytes;
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"BNKFrec1";
const HASH_BYTES: usize = 64;

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
    /// They start otherwise, or end too soon.
    #[error("not a checkpoint of a recursive training run")]
    NotACheckpoint,
    /// Their fingerprint is wrong.
    #[error("the checkpoint is damaged")]
    Damaged,
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
        let mut bytes = MAGIC.to_vec();
        bytes.extend((header.len() as u32).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(state.iter().flat_map(|number| number.to_le_bytes()));
        let hash = of_bytes(&bytes);
        bytes.extend(hash.as_bytes());
        bytes
    }

    /// The inverse of [`Self::to_bytes`].
    ///
    /// # Errors
    /// See [`CheckpointError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let rest = bytes
            .strip_prefix(MAGIC)
            .ok_or(CheckpointError::NotACheckpoint)?;
        let body = bytes.len().saturating_sub(HASH_BYTES);
        if rest.len() < HASH_BYTES + 4 {
            return Err(CheckpointError::NotACheckpoint);
        }
        if of_bytes(&bytes[..body]).as_bytes() != &bytes[body..] {
            return Err(CheckpointError::Damaged);
        }
        let (length, rest) = rest[..rest.len() - HASH_BYTES].split_at(4);
        let length = length
            .iter()
            .rev()
            .fold(0, |sum, &byte| 256 * sum + usize::from(byte));
        let (header, numbers) = rest
            .split_at_checked(length)
            .ok_or(CheckpointError::OtherVersion)?;
        let header: Header =
            serde_json::from_slice(header).map_err(|_| CheckpointError::OtherVersion)?;
        let state: Vec<f32> = numbers
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        let network =
            Network::from_state(&state, header.updates).ok_or(CheckpointError::OtherVersion)?;
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
        for length in [0, 7, 8, 40, 75] {
            assert_eq!(
                Checkpoint::parse(&bytes[..length]).unwrap_err(),
                CheckpointError::NotACheckpoint
            );
        }
        assert_eq!(
            Checkpoint::parse(&bytes[..bytes.len() - 1]).unwrap_err(),
            CheckpointError::Damaged
        );
        for at in [9, 40, 5000] {
            let mut bad = bytes.clone();
            bad[at] ^= 1;
            assert_eq!(
                Checkpoint::parse(&bad).unwrap_err(),
                CheckpointError::Damaged
            );
        }
    }
}
