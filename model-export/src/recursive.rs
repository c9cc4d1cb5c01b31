//! Training of the recursive tracker through its unrolled filter.
//!
//! The filter step is the firmware's own, generic over [`bnkf::scalar::Scalar`]: in `f64` it is the
//! naive twin of what flies in `f32`; recorded on a [`Tape`](crate::autodiff::tape::Tape) it becomes a
//! [`Program`](crate::autodiff::program::Program) that runs forwards and backwards over lanes of flights.

pub mod augmentation;
pub mod batch;
pub mod bends;
pub mod carry;
pub mod checkpoint;
pub mod committee;
pub mod comparison;
pub mod elsewhere;
pub mod encounter;
pub mod frequencies;
pub mod model;
pub mod network;
pub mod normalisation;
pub mod population;
pub mod provenance;
pub mod recipe;
mod recorded_clock;
pub mod scenario;
pub mod score;
pub mod sensor;
pub mod step;
pub mod step_programs;
pub mod stress;
pub mod training;
pub mod training_progress;
pub mod trial;
pub mod tunable;
pub mod tuning;
pub mod unrolled;
