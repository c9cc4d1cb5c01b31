//! The simulated measurement loop: baselines, metrics, reports, and the image in QEMU.

pub mod baseline;
pub mod campaign;
pub mod cmd;
pub mod contest;
pub mod csv_text;
pub mod doubt;
pub mod exchange;
pub mod filter;
pub mod image;
pub mod manoeuvre;
pub mod method;
pub mod output_folder;
pub mod own_name;
pub mod parquet_columns;
pub mod plot;
pub mod replication;
pub mod report;
pub mod scenario;
pub mod scoring;
