//! The full evaluation: cross-validated, resumable, reported.

pub mod work_folder;
