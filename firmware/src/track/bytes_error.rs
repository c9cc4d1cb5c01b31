//! Why bytes are no track.

/// A part of a track as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TrackField {
    /// A correction that does not fit the kind.
    Settings,
    /// The times of it and of what it holds.
    Clock,
    /// The latest measurement.
    Measurement,
    /// The random stream.
    Generator,
    /// State or covariance of the target.
    Target,
    /// What the network reads beside them, or how forecasts came true.
    Memory,
    /// The second track.
    Candidate,
    /// The latest estimates of a memoryless track.
    Fix,
    /// A flag or a number of passes that means nothing, or room that is not empty.
    Padding,
}

/// Why bytes are no track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TrackBytesError {
    /// They do not begin as a track does.
    NotATrack,
    /// A version of the layout that this code does not know.
    UnknownVersion(u16),
    /// The checksum does not match: bytes were lost.
    WrongChecksum,
    /// A kind of track that this code does not know.
    UnknownKind(u8),
    /// No track has this value.
    Invalid(TrackField),
}

impl core::fmt::Display for TrackBytesError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotATrack => f.write_str("not a track"),
            Self::UnknownVersion(version) => {
                write!(
                    f,
                    "a track of version {version}, which this code does not know"
                )
            }
            Self::WrongChecksum => f.write_str("the track's checksum does not match"),
            Self::UnknownKind(kind) => write!(f, "a track of kind {kind}"),
            Self::Invalid(field) => write!(f, "no track has such a value: {field:?}"),
        }
    }
}

impl core::error::Error for TrackBytesError {}
