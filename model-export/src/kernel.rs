//! The arithmetic of the training step, written once and compiled for each instruction set.
//!
//! Every kernel gives the same bits on every instruction set: sums run in one fixed order, every
//! multiply-add is fused, and `sqrt` and division round correctly. Matrices are row-major `f32`
//! with a row stride that is a multiple of [`LANES`]; the padding is zero and stays zero.
//!
//! Panics if a slice is shorter than its stated shape: shapes come from the caller's own layout,
//! never from input.

mod adam;
mod aligned;
mod gelu;
mod normal;
mod product;
pub(crate) mod tier;

pub use adam::{AdamStep, Moments, Posterior, adam};
pub use aligned::Aligned;
pub use gelu::{Hidden, hidden_backward, hidden_forward, sample_output};
pub use normal::{exp_in_place, fill_normal};
pub use product::{add_columns, rows_times, transposed_times};
pub use tier::Tier;

/// Row strides are multiples of this many values: one 512-bit register.
pub const LANES: usize = 16;

/// Rows that go through the network together; activations of one block stay in the cache.
pub const BLOCK_ROWS: usize = 64;
