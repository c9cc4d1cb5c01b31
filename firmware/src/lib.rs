//! Bayesian neural Kalman tracking for radar nodes: `no_std`, no allocation, static memory.
//!
//! A [`Model`] is a checked blob of quantised weights; a [`Track`] is what is known of one target, 1.4 KB
//! without a reference; a [`Workspace`] is the memory that a step works in, one for all tracks. A
//! [`Tracker`] is one of each, for one target. The same code runs on the microcontroller and on the
//! host, and gives the same bits.
//!
//! ```
//! use bnkf::{Measurement, Mode, Model, Sensed, Sensor, Settings, Tracker};
//!
//! static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");
//!
//! let model = Model::new(BLOB)?;
//! let mut tracker = Tracker::new(model, Settings::of(model.blob()))?;
//! let sensed = |value, sigma| Some(Sensed { value, sigma });
//! let mut plot = Measurement {
//!     time_us: 1_000_000,
//!     range: sensed(33.2, 0.1),
//!     elevation: sensed(0.4, 0.005),
//!     azimuth: sensed(0.5, 0.005),
//!     range_rate: sensed(-1.5, 0.05),
//!     sensor: Sensor::ORIGIN,
//! };
//! assert_eq!(tracker.step(&plot)?.mode, Mode::Started);
//! (plot.time_us, plot.range) = (1_100_000, sensed(33.0, 0.1));
//! let estimate = tracker.step(&plot)?;
//! assert_eq!(estimate.mode, Mode::Tracking);
//! // Nothing was measured: the covariance grows.
//! let in_a_gap = tracker.coast(1_200_000)?;
//! assert!(in_a_gap.covariance_m2[0][0] > estimate.covariance_m2[0][0]);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! Several targets on one model: a plot goes to the track that it fits best.
//!
//! ```
//! # use bnkf::{Measurement, Model, Sensed, Sensor, Settings, Track, Workspace};
//! # static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");
//! let model = Model::new(BLOB)?;
//! let settings = Settings::of(model.blob());
//! let mut workspace = Workspace::new();
//! let mut tracks = [Track::new(&model, settings)?, Track::new(&model, settings)?];
//! let sensed = |value, sigma| Some(Sensed { value, sigma });
//! let plot = |time_us, range, azimuth| Measurement {
//!     time_us,
//!     range: sensed(range, 0.1),
//!     elevation: sensed(0.4, 0.005),
//!     azimuth: sensed(azimuth, 0.005),
//!     range_rate: sensed(0.0, 0.05),
//!     sensor: Sensor::ORIGIN,
//! };
//! tracks[0].step(&model, &mut workspace, &plot(0, 30.0, 0.5))?;
//! tracks[1].step(&model, &mut workspace, &plot(0, 40.0, -0.5))?;
//!
//! let next = plot(100_000, 40.1, -0.5);
//! let mut fits = [0.0; 2];
//! for (track, fit) in tracks.iter_mut().zip(&mut fits) {
//!     *fit = track.likelihood(&model, &mut workspace, &next)?.ln_likelihood;
//! }
//! assert!(fits[1] > fits[0]);
//! tracks[1].step(&model, &mut workspace, &next)?;
//!
//! // A clone is a snapshot; as bytes it survives a reset of the board.
//! let mut bytes = [0; bnkf::TRACK_SNAPSHOT_BYTES];
//! tracks[1].to_bytes(&mut bytes);
//! let mut restored = Track::from_bytes(&bytes)?;
//! assert_eq!(
//!     restored.coast(&model, &mut workspace, 200_000)?,
//!     tracks[1].coast(&model, &mut workspace, 200_000)?
//! );
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! Frame and units at every public boundary: x east, y north, z up, the radar at the origin unless a
//! measurement says where its [`Sensor`] is; azimuth from +x towards +y, elevation from the
//! horizontal, range-rate positive outbound; metres, seconds, radians, metres per second. A sensor
//! that moves and looks along its own axes:
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
//! Beside these pages are programs: `examples/single.rs`, `many.rs` (plots of several targets sorted by likelihood),
//! `interrupt.rs` (measurements that come in an interrupt), and `c/`.
//!
//! # Features
//!
//! The first three are on by default. Without them the image of the recursive tracker is 79 KB of code in place of
//! 123, and needs 8.0 KB of memory in place of 13.6; what is left out is refused ([`Part`]).
//!
//! | feature | what |
//! |---|---|
//! | `memoryless` | models that answer with a position: the paper's BNN, BNKF and BNKFe |
//! | `passes` | Monte Carlo passes ([`Inference::Passes`]) |
//! | `moments` | moments without passes ([`Inference::Moments`]) |
//! | `serde` | `Serialize` and `Deserialize` for public values: measurements, estimates, settings, errors |
//! | `defmt` | `defmt::Format` for the same |
//! | `c` | the functions that `include/bnkf.h` declares |
//! | `c-library` | `c` for a static library that stands alone: with a panic handler, which must not be needed |
//! | `image`, `image-board` | the program `tracker-image` for a Cortex-M4F, for QEMU or a debugger, or a board of its own |
//! | `bench` | the program `bench`, which counts cycles on a board; not yet run on one |
//! | `same-bits`, `panic-free` | programs that tests build: the same bits on every core, no path to a panic |
//!
//! # Oldest compiler
//!
//! Rust 1.90, which CI checks. A newer one is asked for only in a release that changes the second number of the
//! version (0.x), with a line in the changelog, and never one younger than half a year.
//!
//! What this is not: no attitude estimation, no multi-target association, no networking.
#![no_std]
#![warn(missing_debug_implementations)]

#[cfg(test)]
extern crate std;

// Hidden from the documentation is what only this workspace uses, and changes without notice.
pub mod blob;
#[cfg(feature = "c")]
pub mod c;
pub mod call;
#[doc(hidden)]
pub mod cholesky;
pub mod clock;
#[doc(hidden)]
pub mod ekf;
pub mod estimate;
#[doc(hidden)]
pub mod gaussian;
mod inference;
#[doc(hidden)]
pub mod kernel;
pub mod late;
pub mod likelihood;
pub mod measurement;
#[doc(hidden)]
pub mod memoryless;
mod model;
pub mod mounting;
#[doc(hidden)]
pub mod network;
mod part;
pub mod protocol;
#[doc(hidden)]
pub mod radar;
#[doc(hidden)]
pub mod recursive;
#[doc(hidden)]
pub mod rng;
#[doc(hidden)]
pub mod scalar;
pub mod sensor;
mod series;
mod settings;
mod spread;
mod step_error;
mod track;
mod tracker;
mod trigonometry;
mod workspace;

pub use call::Call;
pub use clock::WrappingClock;
pub use ekf::EkfError;
pub use estimate::{Doubt, Estimate, Mode, Motion};
pub use inference::{Inference, Passes, PassesError};
pub use late::LateTracker;
pub use likelihood::Likelihood;
pub use measurement::{Channel, Measurement, MeasurementError, Sensed};
pub use model::{MODEL_BYTES_MAX, Model};
pub use mounting::{Direction, Mounting};
pub use part::Part;
pub use sensor::{Sensor, SensorError};
pub use settings::{Correction, Settings, TrackerError};
pub use spread::Spread;
pub use step_error::StepError;
pub use track::{
    OtherKind, TRACK_BYTES_MAX, TRACK_SNAPSHOT_BYTES, Track, TrackBytesError, TrackField,
};
pub use tracker::{TRACKER_BYTES_MAX, Tracker};
pub use workspace::{WORKSPACE_BYTES_MAX, Workspace};
