//! The crate for C, as `include/bnkf.h` declares it (`docs/c.md`): nothing here allocates, panics or keeps state.
//!
//! A model, a workspace and a track live in places of C's own, whose size the header says. Every pointer is
//! checked before it is used: null, misaligned, or a place that nothing was made in is a status.

mod estimate;
mod likelihood;
mod measurement;
mod model;
mod mounting;
#[cfg(all(feature = "c-library", target_os = "none"))]
mod panic;
mod place;
mod pointer;
mod settings;
mod status;
#[cfg(test)]
mod tests;
mod track;
mod workspace;

// A library for a host has its panic handler from here.
#[cfg(all(feature = "c-library", not(target_os = "none"), not(test)))]
extern crate std;

pub use estimate::{BnkfEstimate, BnkfMode};
pub use likelihood::BnkfLikelihood;
pub use measurement::{
    BNKF_AZIMUTH, BNKF_ELEVATION, BNKF_RANGE, BNKF_RANGE_RATE, BnkfMeasurement, BnkfSensed,
};
pub use model::{bnkf_model_checksum, bnkf_model_init, bnkf_model_settings};
pub use mounting::{BnkfDirection, bnkf_mounting_direction};
pub use place::{
    BNKF_MODEL_WORDS, BNKF_TRACK_WORDS, BNKF_WORKSPACE_WORDS, BnkfModel, BnkfTrack, BnkfWorkspace,
};
pub use settings::{BnkfCorrection, BnkfInference, BnkfInferenceKind, BnkfSettings};
pub use status::BnkfStatus;
pub use track::{
    bnkf_track_coast, bnkf_track_forecasts, bnkf_track_from_bytes, bnkf_track_hand_over,
    bnkf_track_init, bnkf_track_latest_us, bnkf_track_likelihood, bnkf_track_reset,
    bnkf_track_step, bnkf_track_to_bytes,
};
pub use workspace::bnkf_workspace_init;
