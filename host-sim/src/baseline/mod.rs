//! Estimators the network has to beat, in f64.
//!
//! State order: x, y, z, vx, vy, vz, ... [m, m/s, ...]; reading order: elevation, azimuth, range,
//! range-rate [rad, rad, m, m/s]. Frame: x east, y north, z up, radar at the origin.

pub mod ahead;
pub mod bank;
pub mod bound;
pub mod candidate;
pub mod clock;
pub mod correction;
pub mod discrete;
pub mod gated;
pub mod gaussian;
pub mod imm;
pub mod kalman;
pub mod late;
pub mod memoryless;
pub mod mixture;
pub mod motion;
pub mod origin;
pub mod prior;
pub mod rao_blackwell;
pub mod sensor;
pub mod sigma_points;
pub mod simplex;
pub mod singer;
pub mod tuning;
pub mod turn;
