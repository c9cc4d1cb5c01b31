//! The recursive tracker: a nine-state filter whose motion model the network schedules.
//!
//! Before every prediction the network reads the filter's own state and statistics and answers
//! with the transition and the process noise of the coming interval; the correction is one EKF
//! step with the polar measurement itself. The model stays linear-Gaussian, so the covariance
//! means the same in gaps as elsewhere.

mod answer;
mod belief;
pub mod candidate;
pub mod correction;
pub mod curvature;
pub mod densities;
pub mod envelope;
pub mod factor;
pub mod features;
mod forecast;
pub mod foresight;
pub mod hypotheses;
pub mod interval;
pub mod memory;
pub mod mixture;
mod model;
pub mod motion;
pub mod parameters;
pub mod population;
pub mod schedule;
pub mod sight;
pub mod start;
pub mod state;
pub mod steady;
pub mod target;
mod tracker;

pub(crate) use belief::Belief;
pub use candidate::AGREEING;
pub(crate) use model::Model;
pub(crate) use tracker::{Recursive, WHITENED_MAX};
