//! Files that end with the SHA-256 of all before it, in hexadecimal, and those of numbers with a header: eight
//! bytes of magic, the length of the header (u32, little-endian), the header as JSON, the numbers (f32,
//! little-endian).

use crate::flights::data_hash;

const HASH_BYTES: usize = 64;

/// Why bytes are not such a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SealError {
    /// They start otherwise.
    #[error("starts with other bytes")]
    Magic,
    /// They end too soon, or a bit changed.
    #[error("is damaged: its SHA-256 does not match")]
    Damaged,
}

/// The bytes of a file that holds `header` and `numbers`.
#[must_use]
pub fn seal(magic: &[u8; 8], header: &str, numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    let mut bytes = magic.to_vec();
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(numbers.flat_map(f32::to_le_bytes));
    with_hash(bytes)
}

/// `bytes` and their hash.
#[must_use]
pub fn with_hash(mut bytes: Vec<u8>) -> Vec<u8> {
    let hash = data_hash::of_bytes(&bytes);
    bytes.extend(hash.as_bytes());
    bytes
}

/// What [`with_hash`] was given.
///
/// # Errors
/// The bytes end too soon, or a bit changed.
pub fn without_hash(bytes: &[u8]) -> Result<&[u8], SealError> {
    bytes
        .split_at_checked(bytes.len().saturating_sub(HASH_BYTES))
        .filter(|(body, hash)| data_hash::of_bytes(body).as_bytes() == *hash)
        .map(|(body, _)| body)
        .ok_or(SealError::Damaged)
}

/// Header and numbers of a file that [`seal`] made.
///
/// # Errors
/// See [`SealError`].
pub fn open<'a>(magic: &[u8; 8], bytes: &'a [u8]) -> Result<(&'a [u8], Vec<f32>), SealError> {
    if !bytes.starts_with(magic) {
        return Err(SealError::Magic);
    }
    let rest = without_hash(bytes)?;
    let rest = rest.strip_prefix(magic).ok_or(SealError::Damaged)?;
    let (length, rest) = rest.split_first_chunk::<4>().ok_or(SealError::Damaged)?;
    let (header, numbers) = rest
        .split_at_checked(u32::from_le_bytes(*length) as usize)
        .ok_or(SealError::Damaged)?;
    let numbers = numbers
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    Ok((header, numbers.collect()))
}

#[cfg(test)]
mod tests {
    use super::{SealError, open, seal};

    const MAGIC: &[u8; 8] = b"somemark";

    #[test]
    fn what_is_sealed_is_what_is_opened() {
        let numbers = [1.5, -0.0, f32::MIN_POSITIVE];
        let bytes = seal(MAGIC, "{\"a\":1}", numbers.into_iter());
        let (header, read) = open(MAGIC, &bytes).unwrap();
        assert_eq!(header, b"{\"a\":1}");
        assert_eq!(read, numbers);
        assert!(read[1].is_sign_negative());
    }

    #[test]
    fn every_truncation_and_every_changed_byte_is_found() {
        let bytes = seal(MAGIC, "{}", [1.0, 2.0].into_iter());
        for length in 0..bytes.len() {
            let expected = if length < 8 {
                SealError::Magic
            } else {
                SealError::Damaged
            };
            assert_eq!(open(MAGIC, &bytes[..length]), Err(expected));
        }
        for at in 0..bytes.len() {
            let mut bad = bytes.clone();
            bad[at] ^= 4;
            open(MAGIC, &bad).unwrap_err();
        }
    }
}
