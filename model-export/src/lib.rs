//! Flights, radar sampling, training and export of variational Bayesian networks.

pub mod reading;
