//! How right the firmware's moments without passes are: what many passes of the same weights say.

pub mod comparison;
pub mod inputs;
pub mod reference;
