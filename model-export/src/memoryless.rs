//! Training of the paper's networks, which read two measurements and answer with a position.

pub mod checkpoint;
pub mod example;
pub mod gradient;
pub mod member;
pub mod model;
pub mod normalisation;
pub mod provenance;
pub mod rows;
mod shard;
pub mod training;
pub mod training_data;
pub mod training_progress;
pub mod training_settings;
pub mod verification;
