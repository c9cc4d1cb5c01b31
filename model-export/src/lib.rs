//! Flights, radar sampling, training and export of variational Bayesian networks.

pub mod atomic_file;
pub mod attack;
pub mod autodiff;
pub mod blob;
pub mod brief_number;
pub mod cmd;
pub mod command_line;
pub mod flights;
pub mod import;
pub mod interrupt;
pub mod kernel;
pub mod memoryless;
pub mod moments;
pub mod pending_file;
pub mod posterior;
pub mod radar;
pub mod random_source;
pub mod recursive;
pub mod regular_file;
pub mod scoring;
pub mod seed;
pub mod soundness;
