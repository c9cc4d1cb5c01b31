//! Byte offsets of blob versions 2 to 4; the only place where they are written down.
//!
//! All numbers are little-endian. `BLOB.md` beside the crate says what each field means.

use core::ops::Range;

/// First four bytes of every blob.
pub const MAGIC_BYTES: [u8; 4] = *b"BNKF";
/// Format version whose hidden layers all end in GELU: what is written wherever that is so.
pub const VERSION_GELU: u16 = 2;
/// Format version whose networks name what their hidden layers end in.
pub const VERSION_ACTIVATION: u16 = 3;
/// Format version whose recursive blobs say how much of a forecast's bend comes true. This code reads no
/// later one.
pub const VERSION_BEND: u16 = 4;
/// Units code: metres, seconds, radians, metres per second.
pub const UNITS_SI: u8 = 1;

/// Magic bytes.
pub const MAGIC: Range<usize> = 0..4;
/// Format version, u16.
pub const VERSION: Range<usize> = 4..6;
/// Kind of estimator, u8 (see `Kind`).
pub const KIND: usize = 6;
/// Units code, u8.
pub const UNITS: usize = 7;
/// Length of the whole blob in bytes, u32.
pub const LENGTH: Range<usize> = 8..12;
/// CRC-32 (ISO-HDLC) over all bytes except these four, u32.
pub const CRC: Range<usize> = 12..16;
/// Feature layout id, u8 (see `FeatureLayout`).
pub const FEATURES: usize = 16;
/// Number of networks, u8.
pub const NETWORKS: usize = 17;
/// Inputs of every network, u8.
pub const INPUTS: usize = 18;
/// Outputs of every network, u8.
pub const OUTPUTS: usize = 19;
/// Monte Carlo passes by default, u16.
pub const PASSES: Range<usize> = 20..22;
/// Number of f32 parameters that follow the header, u16.
pub const PARAMETERS: Range<usize> = 22..24;
/// Length of the header.
pub const HEADER_LEN: usize = 24;

/// Parameter index: standard deviation of each velocity component in the population, m/s.
pub const PARAMETER_SPEED_SIGMA: usize = 0;
/// Parameter index: standard deviation of each acceleration component in the population, m/s^2.
pub const PARAMETER_ACCELERATION_SIGMA: usize = 1;
/// Number of parameters of a memoryless blob.
pub const MEMORYLESS_PARAMETERS: usize = 2;
/// Number of parameters of a recursive blob: population, base model, bounds, hypotheses, forecasts (see
/// `BLOB.md`).
pub const RECURSIVE_PARAMETERS: usize = 33;
/// The same before [`VERSION_BEND`].
pub const RECURSIVE_PARAMETERS_BEFORE: usize = 32;
/// Outputs of a recursive blob's network: schedule, factor, the network's notes to itself.
pub const RECURSIVE_OUTPUTS: usize = 36;

/// Layer table entry: inputs, u16.
pub const LAYER_INPUTS: Range<usize> = 0..2;
/// Layer table entry: outputs, u16.
pub const LAYER_OUTPUTS: Range<usize> = 2..4;
/// Layer table entry: offset of the layer's data from the start of the blob, u32.
pub const LAYER_OFFSET: Range<usize> = 4..8;
/// Layer table entry: largest weight variance of the layer, f32.
pub const LAYER_VARIANCE_MAX: Range<usize> = 8..12;
/// Length of a layer table entry.
pub const LAYER_ENTRY_LEN: usize = 12;
/// Bytes before a network's layer entries: number of layers u16, activation u8, a zero byte.
pub const NETWORK_ENTRY_LEN: usize = 4;

/// Bytes from one weight row to the next: the inputs rounded up to four, padded with zeros.
pub const fn row_stride(inputs: usize) -> usize {
    inputs.next_multiple_of(4)
}

/// Bytes of one layer's data: means, variance codes, then per output scale, bias mean, bias variance.
pub const fn layer_len(inputs: usize, outputs: usize) -> usize {
    outputs * (2 * row_stride(inputs) + 12)
}

/// Largest code of a weight's mean; symmetric, so that a code and its negative both exist.
pub const MEAN_CODE_MAX: i8 = 127;
/// Code of a layer's largest variance; zero is no variance at all.
pub const VARIANCE_CODE_MAX: u8 = 255;
/// Codes in an octave of variance.
pub const CODES_PER_OCTAVE: f64 = 8.0;
/// How many octaves a variance is above its layer's largest: none, or less.
pub const fn octaves(code: u8) -> f64 {
    (code as f64 - VARIANCE_CODE_MAX as f64) / CODES_PER_OCTAVE
}

/// Widest layer that the fixed scratch memory of the network holds.
pub const WIDTH_MAX: usize = 64;
/// Most layers of one network.
pub const LAYERS_MAX: usize = 8;
/// Most networks of one blob.
pub const NETWORKS_MAX: usize = 3;
/// Most Monte Carlo passes.
pub const PASSES_MAX: u16 = 10_000;
