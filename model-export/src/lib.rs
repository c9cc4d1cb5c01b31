//! Flights, radar sampling, training and export of variational Bayesian networks.

pub mod atomic_file;
pub mod data_hash;
pub mod flight;
pub mod flight_csv;
pub mod flight_folder;
pub mod flight_statistics;
pub mod gaps;
pub mod generator;
pub mod kernel;
pub mod noise;
pub mod placement;
pub mod polar;
pub mod radar_sampling;
pub mod random_source;
pub mod reading;
pub mod recursive;
pub mod rigid_move;
pub mod seed;
pub mod segment;
pub mod track_error;
pub mod volume;
