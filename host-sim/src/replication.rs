//! The paper replicated both ways: as it is written, as its published code does it, and every
//! difference between the two switched by itself.
//!
//! Frame: x east, y north, z up, radar at the origin; metres, seconds, radians.

pub mod correction;
pub mod departure;
pub mod entry;
pub mod learner;
pub mod moments;
mod network_run;
pub mod observation;
pub mod page;
pub mod pair;
pub mod published;
pub mod recipe;
pub mod results;
pub mod scaling;
pub mod study;
pub mod summary;
