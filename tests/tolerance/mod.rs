//! Every tolerance of the tests in this folder, with its reason.

// Each test file uses its own part of the table.
#![allow(dead_code)]

/// EKF and UKF means and covariances against Stone Soup over 144 steps, relative. Both sides do
/// the same double-precision arithmetic in another order; rounding of 1e-16 a step grows with the
/// condition of P (up to 1e7 at low noise). Measured 2e-12; the rest is left to other platforms'
/// `sin` and `atan2`. The requirement is 1e-6 for the EKF and 1e-5 for the UKF.
pub const FILTER_RELATIVE: f64 = 1e-9;
