//! What estimates of a position are worth beside the truth: in training, and wherever filters are
//! compared.

pub mod horizons;
pub mod means;
pub mod position;
pub mod step_score;
