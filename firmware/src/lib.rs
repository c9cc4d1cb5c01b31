//! Bayesian neural Kalman tracking for radar nodes: `no_std`, no allocation, static memory.
//!
//! A [`Tracker`] reads a [`blob::Blob`] of quantised weight means and variances, draws Monte Carlo
//! passes of the Bayesian network, and corrects their mean and covariance with the measurement.
//! The same code runs on the microcontroller and on the host, and gives the same bits.
//!
//! Frame and units at every public boundary: x east, y north, z up, the radar at the origin unless a
//! measurement says where its [`Sensor`] is; azimuth from +x towards +y, elevation from the
//! horizontal, range-rate positive outbound; metres, seconds, radians, metres per second.
//!
//! ```
//! use bnkf::{Measurement, Mounting, Sensed, Sensor};
//!
//! // A radar on a vehicle that drives north at 15 m/s; its boresight points west, raised by 0.2 rad.
//! let mounting = Mounting::new(1.57, 0.2, 0.0);
//! let sensed = |value, sigma| Sensed { value, sigma };
//! let seen = mounting.direction(sensed(0.1, 0.005), sensed(-0.3, 0.005));
//! let measurement = Measurement {
//!     time_us: 1_000_000,
//!     range: Some(sensed(33.2, 0.1)),
//!     elevation: Some(seen.elevation),
//!     azimuth: seen.azimuth,
//!     range_rate: Some(sensed(-2.5, 0.05)),
//!     sensor: Sensor {
//!         position_m: [120.0, -40.0, 1.8],
//!         velocity_mps: [0.0, 15.0, 0.0],
//!     },
//! };
//! assert_eq!(measurement.check(), Ok(()));
//! ```
//!
//! Trackers and the serial protocol do not panic: `tests/panic_free.rs` links a program that has every operation
//! of theirs, optimised as the image is, and whose panic handler does not exist. Integers that count saturate; sums of the
//! integer kernels cannot overflow for any blob that was parsed (constant assertions in `kernel`), and offsets
//! and sizes are bounded by what was parsed; in a release build whatever else there is would wrap.
//!
//! What this is not: no attitude estimation, no multi-target association, no networking.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod blob;
pub mod call;
pub mod cholesky;
pub mod clock;
pub mod ekf;
pub mod estimate;
pub mod gaussian;
pub mod kernel;
pub mod late;
pub mod likelihood;
pub mod measurement;
pub mod memoryless;
pub mod mounting;
pub mod network;
pub mod protocol;
pub mod radar;
pub mod recursive;
pub mod rng;
pub mod scalar;
pub mod sensor;
mod series;
mod settings;
mod step_error;
mod tracker;

pub use call::Call;
pub use clock::WrappingClock;
pub use estimate::{Doubt, Estimate, Mode, Motion};
pub use late::LateTracker;
pub use likelihood::Likelihood;
pub use measurement::{Channel, Measurement, MeasurementError, Sensed};
pub use mounting::{Direction, Mounting};
pub use network::monte_carlo::Spread;
pub use sensor::{Sensor, SensorError};
pub use settings::{Correction, Settings, TrackerError};
pub use step_error::StepError;
pub use tracker::{TRACKER_BYTES_MAX, Tracker};
