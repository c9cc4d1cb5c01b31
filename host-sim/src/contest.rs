//! Filters on the same readings: who takes part, with which models, and what each made of a flight.

pub mod default_models;
pub mod evaluation;
pub mod example;
pub mod flight_kind;
pub mod fold;
pub mod forecast;
pub mod loss;
pub mod model;
pub mod own_filter;
pub mod roster;
pub mod runs;
pub mod runtime;
pub mod suspicion;
pub mod track;
pub mod tracker_filter;
pub mod tuned_on;
pub mod tunings;
