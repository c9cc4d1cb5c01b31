//! The memoryless tracker (BNN, BNKF, BNKFe): a network estimates the current position from the last
//! two measurements, and one correction follows (paper Section IV-C and IV-D).

mod coast;
mod features;
mod plot;
mod tracker;

pub(crate) use coast::Fix;
pub use features::{FEATURES_MAX, features};
pub use plot::Plot;
pub use tracker::PREVIOUS_AGE_MAX_US;
pub(crate) use tracker::{Memoryless, Model, Past, estimate};
