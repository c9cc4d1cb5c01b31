//! The entries of a zip archive as `torch.save` writes it: stored, not compressed, in one volume.
//!
//! Nothing is unpacked or copied: an entry is a part of the archive's bytes. Nothing here panics.

use bnkf::blob::field::WIDTH_MAX;
use crc::{CRC_32_ISO_HDLC, Crc};

const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

const END_SIGNATURE: [u8; 4] = *b"PK\x05\x06";
const DIRECTORY_SIGNATURE: [u8; 4] = *b"PK\x01\x02";
const LOCAL_SIGNATURE: [u8; 4] = *b"PK\x03\x04";
const END_LEN: usize = 22;
const DIRECTORY_LEN: usize = 46;
const LOCAL_LEN: usize = 30;
/// Bytes of a comment after the end's record, at most.
const COMMENT_MAX: usize = u16::MAX as usize;
const STORED: usize = 0;
/// Bit of the flags that says encrypted.
const ENCRYPTED: usize = 1;

/// Most entries; a network has four tensors a layer, and some files about itself.
pub const ENTRIES_MAX: usize = 16 * WIDTH_MAX;

/// Why bytes are not such an archive.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArchiveError {
    /// There is no record at the end that says where the directory is.
    #[error("not a whole zip archive: it has no end")]
    NoEnd,
    /// The directory or what it names lies outside the bytes.
    #[error("damaged: its directory leads nowhere")]
    Directory,
    /// More entries than a network has.
    #[error("has more than {ENTRIES_MAX} entries")]
    Entries,
    /// Compressed or encrypted.
    #[error("{0:?} is compressed or encrypted, which torch.save never does")]
    Compressed(String),
    /// The entry's bytes are not those that were written.
    #[error("{0:?} is damaged: its CRC-32 does not match")]
    Damaged(String),
    /// There is no such entry.
    #[error("has no entry {0:?}")]
    Missing(String),
}

/// What the directory says of one entry.
#[derive(Clone, Copy, Debug)]
struct Entry<'a> {
    name: &'a [u8],
    is_plain: bool,
    crc: u32,
    size: usize,
    local: usize,
}

/// A view over an archive's bytes.
#[derive(Clone, Debug)]
pub struct Archive<'a> {
    bytes: &'a [u8],
    entries: Vec<Entry<'a>>,
}

fn short(bytes: &[u8], at: usize) -> Option<usize> {
    let two = bytes.get(at..)?.first_chunk()?;
    Some(usize::from(u16::from_le_bytes(*two)))
}

fn long(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn place(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(long(bytes, at)?).ok()
}

impl<'a> Archive<'a> {
    /// Reads the directory of `bytes`.
    ///
    /// # Errors
    /// See [`ArchiveError`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, ArchiveError> {
        let earliest = bytes.len().saturating_sub(END_LEN + COMMENT_MAX);
        let end = bytes
            .get(earliest..)
            .and_then(|tail| tail.windows(4).rposition(|four| four == END_SIGNATURE))
            .and_then(|at| bytes.get(earliest + at..))
            .filter(|end| end.len() >= END_LEN)
            .ok_or(ArchiveError::NoEnd)?;
        let of_end = |read: fn(&[u8], usize) -> Option<usize>, at| read(end, at).unwrap_or(0);
        let count = of_end(short, 10);
        if count > ENTRIES_MAX {
            return Err(ArchiveError::Entries);
        }
        let directory = bytes.get(of_end(place, 16)..);
        let mut left = directory.ok_or(ArchiveError::Directory)?;
        let mut entries = Vec::with_capacity(count);
        for _ in 0..count {
            let (entry, rest) = entry(left).ok_or(ArchiveError::Directory)?;
            entries.push(entry);
            left = rest;
        }
        // Entries that share bytes could be read for ever.
        let sizes = entries.iter().map(|entry| entry.size);
        match sizes.reduce(usize::saturating_add) {
            Some(all) if all > bytes.len() => Err(ArchiveError::Directory),
            _ => Ok(Self { bytes, entries }),
        }
    }

    /// Names of the entries, in order.
    pub fn names(&self) -> impl Iterator<Item = &'a str> {
        let names = self.entries.iter().map(|entry| entry.name);
        names.filter_map(|name| str::from_utf8(name).ok())
    }

    /// The bytes of an entry.
    ///
    /// # Errors
    /// There is none of that name, or its bytes are not plain and whole.
    pub fn read(&self, name: &str) -> Result<&'a [u8], ArchiveError> {
        let mut entries = self.entries.iter();
        let entry = entries
            .find(|entry| entry.name == name.as_bytes())
            .ok_or_else(|| ArchiveError::Missing(name.to_owned()))?;
        if !entry.is_plain {
            return Err(ArchiveError::Compressed(name.to_owned()));
        }
        let data = self.data(entry).ok_or(ArchiveError::Directory)?;
        if CRC32.checksum(data) == entry.crc {
            Ok(data)
        } else {
            Err(ArchiveError::Damaged(name.to_owned()))
        }
    }

    fn data(&self, entry: &Entry<'a>) -> Option<&'a [u8]> {
        let local = self.bytes.get(entry.local..)?;
        local.strip_prefix(&LOCAL_SIGNATURE)?;
        // The name again, and a filling up to a round address.
        let start = LOCAL_LEN + short(local, 26)? + short(local, 28)?;
        local.get(start..)?.get(..entry.size)
    }
}

/// The directory's first entry in `bytes`, and what follows it.
fn entry(bytes: &[u8]) -> Option<(Entry<'_>, &[u8])> {
    bytes.strip_prefix(&DIRECTORY_SIGNATURE)?;
    let flags = short(bytes, 8)?;
    let size = place(bytes, 20)?;
    let is_plain = short(bytes, 10)? == STORED && flags & ENCRYPTED == 0;
    let (name_len, extra, comment) = (short(bytes, 28)?, short(bytes, 30)?, short(bytes, 32)?);
    let entry = Entry {
        name: bytes.get(DIRECTORY_LEN..)?.get(..name_len)?,
        // Stored bytes are as many as there were.
        is_plain: is_plain && place(bytes, 24)? == size,
        crc: long(bytes, 16)?,
        size,
        local: place(bytes, 42)?,
    };
    let rest = bytes.get(DIRECTORY_LEN + name_len + extra + comment..)?;
    Some((entry, rest))
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// An archive of stored entries.
    pub fn zipped(entries: &[(&str, &[u8])]) -> Vec<u8> {
        let (mut bytes, mut directory) = (Vec::new(), Vec::new());
        for (name, data) in entries {
            let local = bytes.len() as u32;
            let sizes = (data.len() as u32).to_le_bytes().repeat(2);
            // Version, flags, method, time and date.
            let mut common = [0; 10].to_vec();
            common.extend(CRC32.checksum(data).to_le_bytes());
            common.extend(&sizes);
            common.extend((name.len() as u16).to_le_bytes());
            common.extend([0, 0]);
            bytes.extend(LOCAL_SIGNATURE);
            bytes.extend(&common);
            bytes.extend(name.as_bytes());
            bytes.extend(*data);
            directory.extend(DIRECTORY_SIGNATURE);
            directory.extend([0, 0]);
            directory.extend(&common);
            directory.extend([0; 10]);
            directory.extend(local.to_le_bytes());
            directory.extend(name.as_bytes());
        }
        let start = bytes.len() as u32;
        let count = (entries.len() as u16).to_le_bytes();
        bytes.extend(&directory);
        bytes.extend(END_SIGNATURE);
        bytes.extend([0; 4]);
        bytes.extend(count.repeat(2));
        bytes.extend((directory.len() as u32).to_le_bytes());
        bytes.extend(start.to_le_bytes());
        bytes.extend([0, 0]);
        bytes
    }

    #[test]
    fn entries_are_read_back_and_checked() {
        let bytes = zipped(&[("a/one", b"first"), ("a/two", b""), ("b", b"last")]);
        let archive = Archive::parse(&bytes).unwrap();
        assert_eq!(archive.names().collect::<Vec<_>>(), ["a/one", "a/two", "b"]);
        assert_eq!(archive.read("a/one").unwrap(), b"first");
        assert_eq!(archive.read("a/two").unwrap(), b"");
        assert_eq!(archive.read("b").unwrap(), b"last");
        let missing = archive.read("c").unwrap_err().to_string();
        assert_eq!(missing, "has no entry \"c\"");
        let mut changed = bytes.clone();
        let at = changed.windows(5).position(|five| five == b"first");
        changed[at.unwrap()] ^= 1;
        let damaged = Archive::parse(&changed).unwrap().read("a/one");
        assert_eq!(damaged, Err(ArchiveError::Damaged("a/one".into())));
    }

    #[test]
    fn compressed_entries_are_refused_by_name() {
        let bytes = zipped(&[("one", b"first")]);
        let directory = bytes.windows(4).position(|four| four == b"PK\x01\x02");
        for (at, value) in [(8, 1), (10, 8), (24, 4)] {
            let mut changed = bytes.clone();
            changed[directory.unwrap() + at] = value;
            let refused = Archive::parse(&changed).unwrap().read("one");
            assert_eq!(refused, Err(ArchiveError::Compressed("one".into())), "{at}");
        }
    }

    /// A few bytes under many names would be many bytes to check.
    #[test]
    fn entries_do_not_share_bytes() {
        let mut bytes = zipped(&[("a", &[7; 4000]), ("b", b"")]);
        let entry = bytes.len() - END_LEN - DIRECTORY_LEN - 1;
        let size = 4000_u32.to_le_bytes();
        bytes[entry + 20..entry + 28].copy_from_slice(&size.repeat(2));
        assert_eq!(Archive::parse(&bytes).unwrap_err(), ArchiveError::Directory);
    }

    #[test]
    fn no_truncation_and_no_changed_byte_panics() {
        let bytes = zipped(&[("a/one", b"first"), ("b", b"last")]);
        for length in 0..bytes.len() {
            Archive::parse(&bytes[..length]).unwrap_err();
        }
        for at in 0..bytes.len() {
            for value in [0, 1, 0x7F, 0xFF] {
                let mut changed = bytes.clone();
                changed[at] = value;
                if let Ok(archive) = Archive::parse(&changed) {
                    let names: Vec<&str> = archive.names().collect();
                    for name in names {
                        // Whatever it says, it says it.
                        let _read = archive.read(name);
                    }
                }
            }
        }
        let many = (ENTRIES_MAX as u16 + 1).to_le_bytes();
        let mut changed = bytes.clone();
        let end = changed.len() - 12;
        changed[end..end + 2].copy_from_slice(&many);
        assert_eq!(Archive::parse(&changed).unwrap_err(), ArchiveError::Entries);
    }
}
