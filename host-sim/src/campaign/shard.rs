//! One share of a campaign that several processes or machines divide among themselves.

use std::str::FromStr;

/// Most shares.
pub const SHARDS_MAX: usize = 10_000;

/// Share `number` of `count`, written `number/count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    count: usize,
}

/// Why a text names no share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// Not two numbers with a stroke between them.
    #[error("`{0}` is not K/N, two whole numbers: 1/4 is the first of four shards")]
    Form(String),
    /// No shares, or more than [`SHARDS_MAX`].
    #[error("{0} shards: there are 1 to {SHARDS_MAX}")]
    Count(usize),
    /// A number that no share has.
    #[error("shard {number} of {count}: shards are numbered from 1 to {count}")]
    Number {
        /// The number.
        number: usize,
        /// How many there are.
        count: usize,
    },
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self {
        number: 1,
        count: 1,
    };

    /// Share `number` of `count`.
    ///
    /// # Errors
    /// There is no such share.
    pub const fn new(number: usize, count: usize) -> Result<Self, ShardError> {
        if count == 0 || count > SHARDS_MAX {
            return Err(ShardError::Count(count));
        }
        if number == 0 || number > count {
            return Err(ShardError::Number { number, count });
        }
        Ok(Self { number, count })
    }

    /// Its number, from 1.
    pub const fn number(self) -> usize {
        self.number
    }

    /// How many shares there are.
    pub const fn count(self) -> usize {
        self.count
    }

    /// Whether piece `index` of a list is of this share: every piece is of exactly one.
    pub const fn holds(self, index: usize) -> bool {
        index % self.count == self.number - 1
    }

    /// How many of the first `pieces` it holds.
    pub const fn size(self, pieces: usize) -> usize {
        (pieces + self.count - self.number) / self.count
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        // Not what `parse` takes besides: a sign.
        let number = |part: &str| {
            let digits = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            digits.then(|| part.parse().ok()).flatten()
        };
        let parts = text.split_once('/');
        let numbers =
            parts.and_then(|(number_of, count)| Some((number(number_of)?, number(count)?)));
        let (number, count) = numbers.ok_or_else(|| ShardError::Form(text.to_owned()))?;
        Self::new(number, count)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::{SHARDS_MAX, Shard, ShardError};

    #[test]
    fn every_piece_is_of_one_shard() {
        for count in [1, 2, 3, 7, 20] {
            for pieces in 0..15 {
                let shards = (1..=count).map(|number| Shard::new(number, count).unwrap());
                let mut held = vec![0; pieces];
                for shard in shards {
                    let own: Vec<_> = (0..pieces).filter(|index| shard.holds(*index)).collect();
                    assert_eq!(own.len(), shard.size(pieces), "{shard} of {pieces}");
                    own.iter().for_each(|index| held[*index] += 1);
                }
                assert!(held.iter().all(|times| *times == 1));
            }
        }
        assert!((0..9).all(|index| Shard::WHOLE.holds(index)));
    }

    #[test]
    fn what_names_no_shard_is_said() {
        assert_eq!("2/4".parse(), Shard::new(2, 4));
        assert_eq!(Shard::new(2, 4).unwrap().to_string(), "2/4");
        for wrong in [
            "", "1", "1/", "/4", "a/b", "1/4/4", "-1/4", "+1/4", "1 / 4", "1.0/4",
        ] {
            let error = wrong.parse::<Shard>().unwrap_err();
            assert_eq!(error, ShardError::Form(wrong.to_owned()));
        }
        let complaint = |text: &str| text.parse::<Shard>().unwrap_err().to_string();
        assert_eq!(
            complaint("0/4"),
            "shard 0 of 4: shards are numbered from 1 to 4"
        );
        assert_eq!(
            complaint("5/4"),
            "shard 5 of 4: shards are numbered from 1 to 4"
        );
        assert!(complaint("1/0").starts_with("0 shards"));
        assert!(complaint(&format!("1/{}", SHARDS_MAX + 1)).starts_with("10001 shards"));
    }
}
