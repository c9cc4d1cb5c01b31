//! The simulated measurement loop: baselines, metrics, reports, and the image in QEMU.

pub mod baseline;
pub mod cell;
pub mod chi_square;
pub mod cmd;
pub mod default_models;
pub mod evaluation;
pub mod filter;
pub mod flight_set;
pub mod image_build;
pub mod image_equality;
pub mod image_log;
pub mod image_session;
pub mod method;
pub mod metrics;
pub mod model;
pub mod plot;
pub mod progress;
pub mod qemu;
pub mod results_json;
pub mod roster;
pub mod table;
pub mod toolchain;
pub mod track;
pub mod tracker_filter;
