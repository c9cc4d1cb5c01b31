//! Flights: read from files or generated, cut into segments, placed around the radar, and divided into
//! those to learn from and those held out.

pub mod agile;
pub mod csv;
pub mod data_hash;
pub mod dataflash;
pub mod flight;
pub mod flight_file;
pub mod folder;
pub mod generator;
pub mod geodetic;
pub mod held_out;
pub mod placement;
pub mod rigid_move;
pub mod segment;
pub mod set;
pub mod suspicion;
pub mod track_error;
pub mod ulog;
pub mod volume;
