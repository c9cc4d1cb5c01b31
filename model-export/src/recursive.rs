//! Training of the recursive tracker through its unrolled filter.
//!
//! One filter step is written once, generically over [`scalar::Scalar`]: in `f64` it is the naive
//! twin of the firmware's `f32` step; recorded on a [`Tape`](crate::autodiff::tape::Tape) it becomes a
//! [`Program`](crate::autodiff::program::Program) that runs forwards and backwards over lanes of flights.

pub mod augmentation;
pub mod batch;
pub mod carry;
pub mod checkpoint;
pub mod cholesky;
pub mod committee;
pub mod comparison;
pub mod correction;
pub mod curvature;
pub mod encounter;
pub mod features;
pub mod line_of_sight;
pub mod model;
pub mod motion;
pub mod network;
pub mod observation;
pub mod provenance;
pub mod recipe;
pub mod scalar;
pub mod scenario;
pub mod schedule;
pub mod score;
pub mod sensor;
pub mod start;
pub mod step;
pub mod step_programs;
pub mod stress;
pub mod training;
pub mod training_progress;
pub mod trial;
pub mod unrolled;
