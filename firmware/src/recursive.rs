//! The recursive tracker: a nine-state filter whose motion model the network schedules.
//!
//! Before every prediction the network reads the filter's own state and statistics and answers
//! with the transition and the process noise of the coming interval; the correction is one EKF
//! step with the polar measurement itself. The model stays linear-Gaussian, so the covariance
//! means the same in gaps as elsewhere.

mod curvature;
mod features;
mod memory;
mod motion;
mod population;
mod schedule;
mod sight;
mod start;
mod tracker;

pub use features::{FEATURE_LIMIT, FEATURES};
pub use memory::NOTES;
pub use population::{Base, Population};
pub use schedule::{JERK_OUTPUT, JERK_SCALE, SCHEDULE};
pub(crate) use tracker::Recursive;
pub use tracker::{GATE_NIS, REJECTIONS_MAX};
