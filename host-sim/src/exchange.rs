//! Readings out, estimates in: files between this program and others.

pub mod columns;
pub mod estimates;
pub mod plots;
pub mod readings;
pub mod recorded_estimates;
pub mod self_consistency;
pub mod tracked;
